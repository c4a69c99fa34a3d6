"""Commands that change how the vehicle flies, each handed to its handler: what it does, and what it answers."""

from __future__ import annotations

import math

import pytest

from app.simulator.commands.flight import FlightCommands
from app.simulator.commands.link import Request
from app.simulator.dialect import Message
from app.simulator.mission.geofence import Geofence
from app.simulator.navigator.context import Deployment
from app.simulator.navigator.mission_mode import MissionMode
from app.simulator.navigator.modes import HoldMode, TakeoffMode
from app.simulator.navigator.orbit_mode import TANGENT, OrbitMode
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Mode, Result, VtolState
from tests.support.airborne_vehicle import FRAME, GROUND_AMSL_M, Airborne
from tests.support.simulated_vehicle import GROUND, NAN, waypoint

FORCE = 21196.0
THERE = FRAME.to_global(60.0, 30.0)
UP_M = 35.0


class Nobody:
    """The channel of who waits for no answer."""

    gcs_heard_s: float | None = None

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        raise AssertionError("a handler answers by its result")


class Commanded:
    """A vehicle 20 m above the ground in hold, with the modes that commands speak to; none is stepped by itself."""

    def __init__(self, airframe: str = "quad") -> None:
        self.air = air = Airborne(airframe)
        self.transitions: list[float] = []
        self.mission = MissionMode(air.context, air.store, air.result, Deployment())
        self.hold = HoldMode(air.context)
        self.takeoff = TakeoffMode(air.context)
        self.orbit = OrbitMode(air.context)
        self.commands = FlightCommands(
            air.context, air.commander, self.mission, self.hold, self.takeoff, self.orbit, self._transition,
            lambda: Geofence((), FRAME),
        )  # fmt: skip

    def _transition(self, state: float) -> Result:
        self.transitions.append(state)
        return Result.DENIED

    def give(
        self, command: Cmd, *params: float, place: tuple[float, float] = (NAN, NAN), up_m: float = NAN
    ) -> Result | None:
        p1, p2, p3 = (*params, 0.0, 0.0, 0.0)[:3]
        request = Request(command, p1, p2, p3, 0.0, *place, up_m + GROUND_AMSL_M, Nobody(), GROUND)
        return self.commands.handlers()[command](request)

    def give_takeoff(self, z: float) -> Result | None:
        request = Request(Cmd.NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, NAN, NAN, z, Nobody(), GROUND)
        return self.commands.handlers()[Cmd.NAV_TAKEOFF](request)

    @property
    def mode(self) -> Mode:
        return self.air.status.mode


# modes ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "mode"),
    [(Cmd.MISSION_START, Mode.MISSION), (Cmd.NAV_LAND, Mode.LAND), (Cmd.NAV_RETURN_TO_LAUNCH, Mode.RTL)],
)
def test_a_command_that_names_a_mode_goes_to_the_commander(command: Cmd, mode: Mode) -> None:
    vehicle = Commanded()
    assert (vehicle.give(command), vehicle.mode) == (Result.ACCEPTED, mode)
    vehicle.air.result.valid = vehicle.air.status.position_valid = False
    assert vehicle.give(command) is not Result.ACCEPTED


@pytest.mark.parametrize(
    ("main", "sub", "mode"),
    [
        (4, 4, Mode.MISSION),
        (4, 5, Mode.RTL),
        (3, 0, Mode.POSCTL),
        (3, 1, Mode.ORBIT),
        (2, 0, Mode.ALTCTL),
        (2, 4, Mode.ALTCTL),  # only auto and position control have sub modes
        (6, 1, Mode.OFFBOARD),
        (10, 0, Mode.TERMINATION),
    ],
)
def test_a_mode_is_named_by_its_main_and_its_sub_mode(main: int, sub: int, mode: Mode) -> None:
    vehicle = Commanded()
    vehicle.air.status.armed = False
    assert (vehicle.give(Cmd.DO_SET_MODE, 1, main, sub), vehicle.mode) == (Result.ACCEPTED, mode)


@pytest.mark.parametrize(("main", "sub"), [(4, 99), (8, 4), (3, 4), (99, 0)])
def test_a_mode_that_does_not_exist_is_rejected_with_a_text(main: int, sub: int) -> None:
    vehicle = Commanded()
    assert vehicle.give(Cmd.DO_SET_MODE, 1, main, sub) is Result.TEMPORARILY_REJECTED
    assert (vehicle.air.said, vehicle.mode) == (["Unsupported auto mode"], Mode.LOITER)


@pytest.mark.parametrize(("base", "taken"), [(0, False), (1, True), (2, False), (128, False), (129, True)])
def test_a_mode_counts_only_with_the_flag_of_custom_modes(base: int, taken: bool) -> None:
    vehicle = Commanded()
    wanted = Result.ACCEPTED if taken else Result.TEMPORARILY_REJECTED
    assert vehicle.give(Cmd.DO_SET_MODE, base, 4, 5) is wanted
    assert vehicle.mode is (Mode.RTL if taken else Mode.LOITER)


def test_a_mode_that_cannot_run_now_is_refused() -> None:
    vehicle = Commanded()
    vehicle.air.status.position_valid = False
    assert vehicle.give(Cmd.DO_SET_MODE, 1, 4, 4) is Result.TEMPORARILY_REJECTED
    assert vehicle.give_takeoff(NAN) is Result.TEMPORARILY_REJECTED
    assert vehicle.mode is Mode.LOITER


# arming -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", [1.0, 0.6])
def test_1_arms_and_the_magic_number_forces_it(value: float) -> None:
    vehicle = Commanded()
    vehicle.air.status.armed = False
    vehicle.air.status.gps_lost = True
    for force, result in ((0.0, Result.TEMPORARILY_REJECTED), (1.0, Result.TEMPORARILY_REJECTED), (FORCE, 0)):
        assert vehicle.give(Cmd.COMPONENT_ARM_DISARM, value, force) == result
        assert vehicle.air.status.armed is (force == FORCE)


@pytest.mark.parametrize("value", [0.0, 0.4])
def test_0_disarms_and_in_the_air_only_by_force(value: float) -> None:
    vehicle = Commanded()
    assert vehicle.give(Cmd.COMPONENT_ARM_DISARM, value, 1.0) is Result.TEMPORARILY_REJECTED
    assert vehicle.air.status.armed
    assert vehicle.give(Cmd.COMPONENT_ARM_DISARM, value, FORCE) is Result.ACCEPTED
    assert not vehicle.air.status.armed


@pytest.mark.parametrize("value", [2.0, -1.0])
def test_any_other_value_is_not_supported_and_changes_nothing(value: float) -> None:
    for armed in (True, False):
        vehicle = Commanded()
        vehicle.air.status.armed = armed
        assert vehicle.give(Cmd.COMPONENT_ARM_DISARM, value, FORCE) is Result.UNSUPPORTED
        assert vehicle.air.status.armed is armed


# takeoff, speed, transition ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("z", "up_m", "default"), [(NAN, 25.0, True), (0.0, 25.0, True), (GROUND_AMSL_M + 40, 40.0, False)]
)
def test_a_takeoffs_height_is_above_the_sea_and_0_or_none_is_the_default(z: float, up_m: float, default: bool) -> None:
    vehicle = Commanded()
    vehicle.air.params.set("MIS_TAKEOFF_ALT", 5.0)
    assert (vehicle.give_takeoff(z), vehicle.mode) == (Result.ACCEPTED, Mode.TAKEOFF)
    vehicle.takeoff.activate()
    assert vehicle.air.context.setpoint.up_m == pytest.approx(up_m)
    assert bool(vehicle.air.said) is default


@pytest.mark.parametrize("speed_m_s", [0.5, 7.0])
def test_a_speed_holds_for_this_leg_and_the_next_and_without_one_it_is_the_default_again(speed_m_s: float) -> None:
    vehicle = Commanded()
    context = vehicle.air.context
    assert vehicle.give(Cmd.DO_CHANGE_SPEED, 1, speed_m_s) is Result.ACCEPTED
    assert (context.setpoint.cruise_speed_m_s, context.cruise_speed_m_s) == (speed_m_s, speed_m_s)
    for default in (-1.0, 0.0):
        vehicle.give(Cmd.DO_CHANGE_SPEED, 1, speed_m_s)
        vehicle.give(Cmd.DO_CHANGE_SPEED, 1, default)
        assert math.isnan(context.setpoint.cruise_speed_m_s)
        assert math.isnan(context.cruise_speed_m_s)


def test_a_transition_is_the_airframes_to_answer() -> None:
    vehicle = Commanded("vtol")
    assert (vehicle.give(Cmd.DO_VTOL_TRANSITION, 4), vehicle.transitions) == (Result.DENIED, [4])


# reposition and orbit ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("flags", [0, 2])
def test_a_reposition_that_does_not_change_to_hold_is_denied_outside_of_it(flags: int) -> None:
    vehicle = Commanded()
    vehicle.air.commander.change_mode(Mode.MISSION)
    assert vehicle.give(Cmd.DO_REPOSITION, 3.0, flags, place=THERE, up_m=UP_M) is Result.DENIED
    assert vehicle.mode is Mode.MISSION


@pytest.mark.parametrize(
    ("before", "flags"), [(Mode.MISSION, 1), (Mode.MISSION, 3), (Mode.LOITER, 0), (Mode.LOITER, 1), (Mode.LOITER, 2)]
)
def test_a_reposition_flies_there_in_hold(before: Mode, flags: int) -> None:
    vehicle = Commanded()
    vehicle.air.commander.change_mode(before)
    assert vehicle.give(Cmd.DO_REPOSITION, 3.0, flags, place=THERE, up_m=UP_M) is Result.ACCEPTED
    assert vehicle.mode is Mode.LOITER
    vehicle.hold.step()
    setpoint = vehicle.air.context.setpoint
    assert (setpoint.kind, setpoint.up_m, setpoint.cruise_speed_m_s) == (SetpointKind.LOITER, UP_M, 3.0)
    assert setpoint.point == pytest.approx((60.0, 30.0))


@pytest.mark.parametrize("place", [(NAN, NAN), (NAN, THERE[1]), (THERE[0], NAN)])
def test_half_a_place_is_none_and_the_height_counts_all_the_same(place: tuple[float, float]) -> None:
    vehicle = Commanded()
    vehicle.air.place(5.0, 6.0, 20.0)
    vehicle.give(Cmd.DO_REPOSITION, -1.0, 1, place=place, up_m=UP_M)
    vehicle.hold.step()
    assert vehicle.air.context.setpoint.point == (5.0, 6.0)
    assert vehicle.air.context.setpoint.up_m == UP_M


def test_an_orbit_flies_in_its_own_mode_where_how_and_how_fast_it_says() -> None:
    vehicle = Commanded()
    vehicle.air.place(60.0, 20.0, UP_M)  # on the circle, west of its centre
    assert vehicle.give(Cmd.DO_ORBIT, 10.0, 3.0, TANGENT, place=THERE, up_m=UP_M) is Result.ACCEPTED
    assert vehicle.mode is Mode.ORBIT
    vehicle.orbit.activate()
    vehicle.orbit.step()
    assert (vehicle.orbit.status.radius_m, vehicle.orbit.status.up_m) == (10.0, UP_M)
    assert vehicle.orbit.status.centre == pytest.approx((60.0, 30.0))
    setpoint = vehicle.air.context.setpoint
    assert setpoint.velocity == pytest.approx((3.0, 0.0), abs=1e-3)
    assert setpoint.yaw_rad == pytest.approx(0.0, abs=1e-3), "along the circle, not to its centre"


@pytest.mark.parametrize("radius_m", [90.0, -90.0])
@pytest.mark.parametrize("airframe", ["plane", "vtol"])
def test_on_wings_an_orbit_is_a_hold_with_that_radius(airframe: str, radius_m: float) -> None:
    vehicle = Commanded(airframe)
    vehicle.air.commander.change_mode(Mode.MISSION)
    assert vehicle.give(Cmd.DO_ORBIT, radius_m, 12.0, place=THERE, up_m=UP_M) is Result.ACCEPTED
    assert vehicle.mode is Mode.LOITER
    vehicle.hold.step()
    setpoint = vehicle.air.context.setpoint
    assert (setpoint.loiter_radius_m, setpoint.loiter_clockwise, setpoint.up_m) == (90.0, radius_m > 0.0, UP_M)
    assert setpoint.point == pytest.approx((60.0, 30.0))


def test_a_vtol_that_hovers_orbits_like_a_multicopter() -> None:
    vehicle = Commanded("vtol")
    vehicle.air.status.vtol_state = VtolState.MC
    assert (vehicle.give(Cmd.DO_ORBIT, 10.0, 3.0), vehicle.mode) == (Result.ACCEPTED, Mode.ORBIT)


@pytest.mark.parametrize("state", [VtolState.TRANSITION_TO_FW, VtolState.TRANSITION_TO_MC])
def test_amid_a_transition_an_orbit_is_rejected_with_a_text(state: VtolState) -> None:
    vehicle = Commanded("vtol")
    vehicle.air.status.vtol_state = state
    assert vehicle.give(Cmd.DO_ORBIT, 10.0, 3.0) is Result.TEMPORARILY_REJECTED
    assert (vehicle.air.said, vehicle.mode) == (["Orbit command rejected"], Mode.LOITER)


# mission index ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wanted", "result", "seq"),
    [(2, Result.ACCEPTED, 2), (0, Result.ACCEPTED, 0), (-1, Result.ACCEPTED, 1), (3, Result.FAILED, 1)],
)
def test_an_index_waits_for_mission_mode_and_minus_1_keeps_the_item(wanted: int, result: Result, seq: int) -> None:
    vehicle = Commanded()
    vehicle.air.status.armed = False
    vehicle.air.upload([waypoint(10, 0, 10), waypoint(20, 0, 10), waypoint(30, 0, 10)])
    vehicle.air.store.current_seq = 1
    assert vehicle.give(Cmd.DO_SET_MISSION_CURRENT, wanted) is result
    assert vehicle.air.store.current_seq == 1
    vehicle.mission.activate()
    assert vehicle.air.store.current_seq == seq


@pytest.mark.parametrize("command", list(Commanded().commands.handlers()))
@pytest.mark.parametrize("rubbish", [NAN, math.inf])
def test_a_number_that_is_none_is_answered_and_does_not_end_the_vehicle(command: Cmd, rubbish: float) -> None:
    vehicle = Commanded()
    assert vehicle.give(command, rubbish, rubbish, rubbish) is not None
