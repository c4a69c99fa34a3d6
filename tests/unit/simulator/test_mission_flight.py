"""A mission from start to landing: progress, texts, landed states and times of scenarios 06, 09 and 25."""

from __future__ import annotations

import itertools

import pytest

from app.simulator.wire import Cmd, LandedState, Mode, Result
from tests.support.simulated_vehicle import RELEASE, RETURN, GroundStation, Plan, do, land, takeoff, waypoint

GROUND, AIR, UP, DOWN = LandedState.ON_GROUND, LandedState.IN_AIR, LandedState.TAKEOFF, LandedState.LANDING
LANDING_DETECTED, DISARMED_BY, MISSION_EXECUTE = 26622124, 32794487, 32375217
"""EVENT ids."""


def event_s(gcs: GroundStation, event_id: int) -> float:
    """When the event came first."""
    return next(h.t_s for h in gcs.received if h.name == "EVENT" and h.message.id == event_id)


def seqs(gcs: GroundStation) -> list[int]:
    return [seq for (seq,) in gcs.changes("MISSION_CURRENT", "seq")]


def landed_states(gcs: GroundStation) -> list[int]:
    return [state for (state,) in gcs.changes("EXTENDED_SYS_STATE", "landed_state")]


@pytest.fixture(scope="module")
def flown() -> GroundStation:
    """Scenario 06, once."""
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(60, 0, 15), RELEASE, waypoint(60, 45, 15), RETURN])
    gcs.until(lambda: not gcs.armed)
    gcs.fly(3.0)
    return gcs


def test_progress_is_shown_as_recorded(flown: GroundStation) -> None:
    assert seqs(flown) in ([0, 1, 3, 4], [0, 1, 2, 3, 4])
    states = flown.changes("MISSION_CURRENT", "mission_state", "mission_mode")
    assert states == [(1, 2), (2, 2), (3, 1), (5, 2)]


def test_reached_is_repeated_in_one_second_slots_at_most_ten_times(flown: GroundStation) -> None:
    times = [h.t_s for h in flown.received if h.name == "MISSION_ITEM_REACHED" and h.message.seq == 4]
    assert len(times) == 11
    gaps = [round(b - a, 2) for a, b in itertools.pairwise(times[1:])]
    assert set(gaps) == {1.0}


def test_texts_tell_the_flight(flown: GroundStation) -> None:
    assert flown.texts() == [
        "Armed by external command",
        "Executing Mission",
        "Climb to 15.0 meters above home",
        "Takeoff detected",
        "Mission finished, loitering",
        "Returning to launch",
        "RTL: start return at 518 m (30 m above destination",
        ")",
        "RTL: land at destination",
        "Landing detected",
        "Disarmed by landing",
    ]


def test_landed_states_and_the_times_between(flown: GroundStation) -> None:
    assert landed_states(flown) == [GROUND, UP, AIR, DOWN, GROUND]
    landed_s = event_s(flown, LANDING_DETECTED)
    disarmed_s = event_s(flown, DISARMED_BY)
    assert disarmed_s - landed_s == pytest.approx(2.0, abs=0.1)
    assert flown.last("HEARTBEAT").custom_mode == Mode.LOITER


def test_the_flight_takes_as_long_as_the_real_one(flown: GroundStation) -> None:
    """Scenario 06: item 0 after 15.6 s, the release after 29.0 s, disarmed after 96.0 s (20 % each)."""
    started_s = event_s(flown, MISSION_EXECUTE)

    def reached_s(seq: int) -> float:
        return next(
            h.t_s - started_s for h in flown.received if h.name == "MISSION_ITEM_REACHED" and h.message.seq == seq
        )

    assert reached_s(0) == pytest.approx(15.6, rel=0.2)
    assert reached_s(2) == pytest.approx(29.0, rel=0.2)
    disarmed_s = event_s(flown, DISARMED_BY)
    assert disarmed_s - started_s == pytest.approx(96.0, rel=0.2)


def test_a_finished_mission_flies_again_without_an_upload() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(5), land()])
    gcs.until(lambda: not gcs.armed)
    assert gcs.last("MISSION_CURRENT").mission_state == 5
    gcs.arm()
    gcs.set_mode(Mode.MISSION)
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 4.0, 30.0)
    assert gcs.last("MISSION_CURRENT").seq == 0


def test_landing_on_the_way_stays_armed_and_goes_on() -> None:
    """Scenario 09: no disarming, landed_state goes from 1 to 2 by way of the next climb."""
    gcs = GroundStation()
    gcs.start([takeoff(10), waypoint(30, 0, 10), land(30), RELEASE, do(Cmd.NAV_DELAY, 3, -1, -1, -1),
                   waypoint(30, 30, 10), RETURN])  # fmt: skip
    gcs.until(lambda: gcs.vehicle.state.gripper.output_released)
    assert gcs.vehicle.state.status.landed
    assert gcs.distance_to(30, 0) < 1.5
    gcs.until(lambda: not gcs.armed)
    assert gcs.texts().count("Disarmed by landing") == 1
    assert landed_states(gcs)[:5] == [GROUND, UP, AIR, DOWN, GROUND]


def test_home_moves_to_where_the_vehicle_disarms() -> None:
    gcs = GroundStation()
    before = gcs.last("HOME_POSITION").latitude
    gcs.start([takeoff(5), waypoint(40, 0, 5), land(40)])
    gcs.until(lambda: not gcs.armed)
    gcs.fly(2.1)
    assert gcs.last("HOME_POSITION").latitude - before == pytest.approx(40 / 0.0111195, abs=120)


def test_a_jump_repeats_as_often_as_it_says() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(5), waypoint(12, 0, 5, 0, 2), waypoint(0, 12, 5, 0, 2), do(Cmd.DO_JUMP, 1, 2), land()])
    gcs.until(lambda: not gcs.armed)
    visited = [m.seq for m in gcs.messages("MISSION_ITEM_REACHED")]
    flips = [seq for index, seq in enumerate(visited) if index == 0 or visited[index - 1] != seq]
    assert flips.count(2) == 3


def test_a_mission_that_ends_in_the_air_holds_there() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(4), waypoint(15, 0, 4)])
    gcs.until(lambda: gcs.vehicle.mission.result.finished)
    gcs.fly(5.0)
    assert gcs.texts()[-1] == "Mission finished, loitering"
    assert gcs.last("HEARTBEAT").custom_mode == Mode.LOITER
    assert (gcs.armed, gcs.vehicle.state.body.ground_speed_m_s) == (True, pytest.approx(0.0, abs=0.3))


def test_a_delay_item_waits_its_time() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(4), do(Cmd.NAV_DELAY, 3, -1, -1, -1), waypoint(20, 0, 4), RETURN])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1)
    assert gcs.until(lambda: gcs.vehicle.store.current_seq == 2) == pytest.approx(3.0, abs=0.1)


def test_a_rover_is_in_the_air_half_a_second_after_arming_and_lands_by_disarming() -> None:
    gcs = GroundStation("rover")
    gcs.arm()
    gcs.fly(1.0)
    assert landed_states(gcs) == [GROUND, AIR]
    gcs.command(Cmd.COMPONENT_ARM_DISARM, 0, 21196)
    gcs.fly(0.5)
    assert landed_states(gcs) == [GROUND, AIR, GROUND]


def test_a_plane_shows_takeoff_on_the_runway_and_landing_with_the_land_item() -> None:
    gcs = GroundStation("plane")
    gcs.start([takeoff(40, 160, 15), waypoint(300, 100, 40), do(Cmd.DO_LAND_START),
                   Plan(Cmd.NAV_LOITER_TO_ALT, 80, 300, 20, (1, 60, 0, 1)), land()])  # fmt: skip
    gcs.until(lambda: not gcs.armed, 250.0)
    gcs.fly(1.0)
    assert landed_states(gcs) == [GROUND, UP, AIR, DOWN, GROUND]
    assert gcs.last("HEARTBEAT").custom_mode == Mode.MISSION


def test_a_home_that_is_moved_in_flight_moves_all_altitudes_above_it() -> None:
    """PX4 flew its drop 25 m above the ground of the takeoff instead of 15 (flown)."""
    gcs = GroundStation()
    gcs.start([takeoff(15), waypoint(60, 0, 15), waypoint(90, 0, 15), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 14.5)
    gcs.fly(3.0)
    home = gcs.last("HOME_POSITION")
    raised = (home.latitude / 1e7, home.longitude / 1e7, home.altitude / 1e3 + 10.0)
    assert gcs.command(Cmd.DO_SET_HOME, 0, 0, 0, 0, *raised) == [Result.ACCEPTED]
    gcs.until(lambda: seqs(gcs)[-1] == 2)
    assert gcs.vehicle.state.body.up_m == pytest.approx(25.0, abs=1.0)
    assert gcs.last("GLOBAL_POSITION_INT").relative_alt == pytest.approx(15_000, abs=1_000)
