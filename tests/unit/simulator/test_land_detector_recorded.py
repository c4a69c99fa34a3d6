"""The flights of scenario 25 in the simulator: the same landed states, the same times within 20 % or one message."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.simulator.wire import Cmd, LandedState, Mode
from tests.support.landing_vehicle import Recording, recording
from tests.support.simulated_vehicle import GroundStation, Plan, do, land, takeoff, waypoint

PERIOD_S = 0.2
"""EXTENDED_SYS_STATE comes at 5 Hz."""
LANDING_DETECTED, TAKEOFF_DETECTED, ARMED_BY, DISARMED_BY = 26622124, 21054825, 26266355, 32794487
"""EVENT ids."""


class Flight:
    """A ground station that notes when the vehicle touches the ground."""

    def __init__(self, kind: str, **params: float) -> None:
        self.gcs = GroundStation(kind, params=dict(params))
        self.touched_s: list[float] = []

    def mission(self, plans: list[Plan]) -> Flight:
        """Armed a second before mission mode, as recorded."""
        assert self.gcs.upload(plans) == 0
        self.gcs.arm()
        self.gcs.fly(0.9)
        self.gcs.set_mode(Mode.MISSION)
        return self.until(lambda: not self.gcs.armed)

    def until(self, condition: Callable[[], bool]) -> Flight:
        gcs, body = self.gcs, self.gcs.vehicle.state.body
        while not condition():
            assert gcs.now_s < 250.0, gcs.where()
            flew = not body.on_ground
            gcs.step()
            if flew and body.on_ground:
                self.touched_s.append(gcs.now_s)
        gcs.fly(0.5)
        return self

    def event_s(self, event_id: int, number: int = 0) -> float:
        return [h.t_s for h in self.gcs.received if h.name == "EVENT" and h.message.id == event_id][number]

    @property
    def landed_states(self) -> list[int]:
        return [state for (state,) in self.gcs.changes("EXTENDED_SYS_STATE", "landed_state")]


def same(simulated_s: float, recorded_s: float) -> None:
    assert simulated_s == pytest.approx(recorded_s, abs=max(0.2 * recorded_s, PERIOD_S))


@pytest.fixture(scope="module")
def quad() -> Flight:
    flight = Flight("quad").mission([takeoff(10), waypoint(20, 0, 10), land(20)])
    gcs = flight.gcs
    gcs.fly(5.0)
    gcs.set_mode(Mode.TAKEOFF)
    gcs.arm()
    gcs.fly(12.0)
    gcs.set_mode(Mode.LAND)
    return flight.until(lambda: not gcs.armed)


@pytest.fixture(scope="module")
def plane() -> Flight:
    return Flight("plane").mission(
        [
            takeoff(40, 160, 15),
            waypoint(300, 100, 40),
            do(Cmd.DO_LAND_START),
            Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1)),
            land(),
        ]
    )


@pytest.fixture(scope="module")
def vtol() -> Flight:
    return Flight("vtol").mission([takeoff(30, 60, 0, 84), waypoint(200, 0, 30), land(0, 0, 85)])


def mode_to_takeoff_s(flight: Flight) -> float:
    accepted = next(
        h.t_s
        for h in flight.gcs.received
        if h.name == "COMMAND_ACK" and h.message.command == Cmd.DO_SET_MODE and h.message.result == 0
    )
    return flight.event_s(TAKEOFF_DETECTED) - accepted


def test_a_quad_shows_the_recorded_states(quad: Flight) -> None:
    assert quad.landed_states == recording("quad").landed_states


def test_a_plane_shows_the_recorded_states(plane: Flight) -> None:
    assert plane.landed_states == recording("plane").landed_states


def test_a_vtol_shows_the_recorded_states_together_with_its_transitions(vtol: Flight) -> None:
    shown = vtol.gcs.changes("EXTENDED_SYS_STATE", "vtol_state", "landed_state")
    assert shown == [(vtol_state, landed) for _, vtol_state, landed in recording("vtol").extended_sys_state]


def test_a_rover_shows_the_recorded_states_and_times() -> None:
    real = recording("rover")
    flight = Flight("rover")
    flight.gcs.upload([waypoint(15, 0, 0), waypoint(15, 10, 0)])
    flight.gcs.arm()
    flight.gcs.fly(0.9)
    flight.gcs.set_mode(Mode.MISSION)
    flight.gcs.fly(40.0)
    assert flight.gcs.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196) == [0]
    flight.gcs.fly(0.5)
    assert flight.landed_states == real.landed_states
    same(flight.event_s(TAKEOFF_DETECTED) - flight.event_s(ARMED_BY), real.between("armed", "takeoff detected"))


def test_the_takeoff_is_detected_when_recorded(quad: Flight, plane: Flight, vtol: Flight) -> None:
    for name, flight in (("quad", quad), ("plane", plane), ("vtol", vtol)):
        same(mode_to_takeoff_s(flight), recording(name).between("mission mode", "takeoff detected"))


def test_a_takeoff_right_after_arming_waits_for_the_motors_to_spool_up(quad: Flight) -> None:
    simulated_s = quad.event_s(TAKEOFF_DETECTED, 1) - quad.event_s(ARMED_BY, 1)
    same(simulated_s, recording("quad").between("armed", "takeoff detected", 1))


@pytest.mark.parametrize("number", [0, 1])
def test_a_quads_landing_is_detected_when_recorded(quad: Flight, number: int) -> None:
    landed_s = quad.event_s(LANDING_DETECTED, number)
    touched_s = max(time_s for time_s in quad.touched_s if time_s < landed_s)
    same(landed_s - touched_s, recording("quad").touch_down_to_landed(number))


@pytest.mark.parametrize("kind", ["plane", "vtol"])
def test_the_landing_is_detected_when_recorded(kind: str, request: pytest.FixtureRequest) -> None:
    flight: Flight = request.getfixturevalue(kind)
    real: Recording = recording(kind)
    same(flight.event_s(LANDING_DETECTED) - flight.touched_s[-1], real.touch_down_to_landed())


def test_a_plane_has_almost_stopped_when_it_has_landed(plane: Flight) -> None:
    recorded_m_s = recording("plane").motion[-1][3]
    landed_s = plane.event_s(LANDING_DETECTED)
    speed_m_s = next(
        h.message.groundspeed for h in plane.gcs.received if h.name == "VFR_HUD" and h.t_s >= landed_s - 0.3
    )
    assert recorded_m_s < speed_m_s < 1.3


def test_a_quad_that_lost_its_range_sensor_lands_two_seconds_later(quad: Flight) -> None:
    flight = Flight("quad")
    flight.gcs.vehicle.faults.range_lost = True
    flight.mission([takeoff(5), land()])
    later_s = flight.event_s(LANDING_DETECTED) - flight.touched_s[-1]
    usual_s = quad.event_s(LANDING_DETECTED) - quad.touched_s[0]
    assert later_s - usual_s == pytest.approx(2.0, abs=0.1)


def test_a_quad_disarmed_in_the_air_falls_freely_and_has_landed() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(20), waypoint(100, 0, 20), land(100)])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 18.0)
    gcs.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196, wait_s=0.0)
    status = gcs.vehicle.state.status
    assert gcs.until(lambda: status.land.freefall, 1.0) == pytest.approx(0.3, abs=0.05)
    gcs.until(lambda: gcs.vehicle.state.body.on_ground, 5.0)
    gcs.fly(0.5)
    assert not status.land.freefall
    assert status.landed_state == LandedState.ON_GROUND


def test_the_reason_of_a_disarming_is_the_recorded_one(quad: Flight) -> None:
    """ARM_DISARM_REASON: 6 landing, twice."""
    reasons = [m.arguments[0] for m in quad.gcs.messages("EVENT") if m.id == DISARMED_BY]
    assert reasons == [6, 6]


def test_the_total_flight_time_can_be_read_as_parameters(quad: Flight) -> None:
    params = quad.gcs.vehicle.params
    took_off = [quad.event_s(TAKEOFF_DETECTED, number) for number in (0, 1)]
    disarmed = [h.t_s for h in quad.gcs.received if h.name == "EVENT" and h.message.id == DISARMED_BY]
    flown_s = sum(end - start for start, end in zip(took_off, disarmed, strict=True))
    assert params.integer("LND_FLIGHT_T_LO") / 1e6 == pytest.approx(flown_s, abs=0.1)
    assert params.integer("LND_FLIGHT_T_HI") == 0
