"""The commander without a vehicle around it: modes in the air, arming, disarming, termination, home."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from app.simulator.commander import Commander
from app.simulator.state import Home
from app.simulator.wire import Mode, Result, SystemStatus
from tests.support.airborne_vehicle import Airborne

DENIED = "Arming denied: Resolve system health failures first"
COMMANDS: list[tuple[Callable[[Commander], Result], Mode, str, str]] = [
    (Commander.return_to_launch, Mode.RTL, "Returning to launch", "commander_rtl"),
    (Commander.land, Mode.LAND, "Landing at current position", "commander_landing_current_pos"),
]


def standing(**params: float) -> Airborne:
    air = Airborne(at=(0.0, 0.0, 0.0), **params)
    air.status.armed = False
    air.land()
    return air


# modes ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("command", "mode", "text", "event"), COMMANDS)
def test_return_and_land_are_said_and_need_a_position_when_armed(
    command: Callable[[Commander], Result], mode: Mode, text: str, event: str
) -> None:
    air = Airborne()
    assert (command(air.commander), air.flown) == (Result.ACCEPTED, (mode, False))
    assert (air.said, air.events) == ([text], [(event,)])
    other = Airborne()
    other.status.position_valid = False
    assert command(other.commander) is Result.TEMPORARILY_REJECTED
    name = {Mode.RTL: "Return", Mode.LAND: "Land"}[mode]
    assert other.said == [f"Switching to {name} is currently not available"]
    assert (other.events, other.flown) == ([("commander_modeswitch_not_avail", mode)], (Mode.LOITER, False))
    other.status.armed = False
    assert (command(other.commander), other.status.mode) == (Result.ACCEPTED, mode)


@pytest.mark.parametrize(
    ("mode", "name"),
    [(Mode.LOITER, "Hold"), (Mode.RTL, "Return"), (Mode.MISSION, "Mission"), (Mode.TAKEOFF, "Takeoff")],
)
def test_a_mode_that_cannot_run_is_refused_in_the_air_by_the_name_that_px4_says(mode: Mode, name: str) -> None:
    assert Airborne().commander.set_mode(mode) is Result.ACCEPTED
    air = Airborne()
    air.status.position_valid = False
    assert air.commander.set_mode(mode) is Result.TEMPORARILY_REJECTED
    assert air.said == [f"Switching to {name} is currently not available"]
    assert air.events == [("commander_modeswitch_not_avail", mode)]
    assert air.commander.mode_changes == 0
    air.status.armed = False
    assert air.commander.set_mode(mode) is Result.ACCEPTED
    assert (air.commander.mode_changes, air.commander.intended, air.flown) == (1, mode, (mode, False))


@pytest.mark.parametrize(("mode", "name"), [(Mode.POSCTL, "Position"), (Mode.ALTCTL, "Altitude")])
def test_a_mode_of_the_sticks_is_refused_in_the_air_by_its_name(mode: Mode, name: str) -> None:
    air = Airborne()
    assert air.commander.set_mode(mode) is Result.TEMPORARILY_REJECTED
    assert air.said == [f"Switching to {name} is currently not available"]


@pytest.mark.parametrize("armed", [True, False])
def test_offboard_alone_is_refused_where_time_runs_too_fast_for_it(armed: bool) -> None:
    air = Airborne()
    air.status.armed = armed
    air.clock.change_speed(12.5)
    air.stream_position()
    assert air.commander.set_mode(Mode.OFFBOARD) is Result.TEMPORARILY_REJECTED
    assert (air.said, air.status.mode) == (["Offboard refused: simulated at 12.5x, limit 4x"], Mode.LOITER)
    assert air.commander.set_mode(Mode.MISSION) is Result.ACCEPTED
    air.clock.change_speed(4.0)
    air.stream_position()
    assert (air.commander.set_mode(Mode.OFFBOARD), air.status.mode) == (Result.ACCEPTED, Mode.OFFBOARD)


def test_a_failsafe_changes_the_mode_and_not_the_intention() -> None:
    air = Airborne()
    air.commander.change_mode(Mode.MISSION)
    air.commander.force_mode(Mode.RTL)
    assert (air.flown, air.commander.intended, air.commander.mode_changes) == ((Mode.RTL, True), Mode.MISSION, 1)
    air.commander.resume(Mode.MISSION)
    assert (air.flown, air.commander.mode_changes) == ((Mode.MISSION, False), 1)


def test_a_start_without_a_valid_mission_is_denied_and_changes_nothing() -> None:
    air = standing()
    air.result.valid = False
    assert air.commander.mission_start() is Result.DENIED
    assert air.said == ["Mission start denied! No valid mission"]
    assert air.events == [("commander_mission_start_denied_no_mission",)]
    assert (air.status.armed, air.status.mode) == (False, Mode.LOITER)


def test_a_start_arms_or_changes_the_mode_alone() -> None:
    air = standing()
    assert air.commander.mission_start() is Result.ACCEPTED
    assert (air.status.armed, air.status.mode) == (True, Mode.MISSION)
    assert air.commander.mission_start() is Result.ACCEPTED, "armed already"
    other = standing()
    other.status.gps_lost = True
    assert other.commander.mission_start() is Result.TEMPORARILY_REJECTED
    assert (other.status.armed, other.status.mode, other.commander.intended) == (False, Mode.MISSION, Mode.MISSION)


# termination ------------------------------------------------------------------------------------------------


def test_termination_stays_whatever_is_wanted_until_a_reboot() -> None:
    air = Airborne()
    air.commander.terminate()
    assert air.flown == (Mode.TERMINATION, True)
    air.commander.force_mode(Mode.RTL)
    assert air.flown == (Mode.TERMINATION, True)
    for refused in (air.commander.set_mode(Mode.LOITER), air.commander.return_to_launch(), air.commander.land()):
        assert refused is Result.TEMPORARILY_REJECTED
    assert (air.flown, air.status.shown_mode) == ((Mode.TERMINATION, True), air.commander.intended)
    air.commander.step()
    assert air.status.system_status is SystemStatus.FLIGHT_TERMINATION
    air.land()
    air.commander.disarm(force=False)
    assert air.flown == (Mode.TERMINATION, False)
    assert not air.commander.checks_good
    air.commander.step()
    assert air.status.system_status is SystemStatus.FLIGHT_TERMINATION
    air.commander.boot()
    air.status.home = Home(0.0, 0.0, 0.0)
    assert (air.status.mode, air.commander.checks_good) == (Mode.LOITER, True)


# arming and disarming ---------------------------------------------------------------------------------------


def test_arming_needs_the_checks_unless_forced_and_says_so() -> None:
    air = standing()
    air.status.gps_lost = True
    assert air.commander.arm(force=False) is Result.TEMPORARILY_REJECTED
    assert (air.said, air.events) == ([DENIED], [("commander_arm_denied_resolve_failures",)])
    assert air.commander.arm(force=True) is Result.ACCEPTED
    assert (air.said[1:], air.events[1:]) == (["Armed by external command"], [("commander_armed_by", 4)])
    assert air.status.armed_at_s == air.clock.now_s
    assert air.commander.arm(force=True) is Result.ACCEPTED
    assert len(air.said) == 2, "armed already"


@pytest.mark.parametrize(
    ("by", "text", "reason"),
    [
        (lambda commander: commander.disarm(force=True), "Disarmed by external command", 4),
        (lambda commander: commander.disarm_by_failsafe(), "Disarmed by failsafe", 14),
    ],
)
@pytest.mark.parametrize("comes_down", [Mode.RTL, Mode.LAND])
def test_disarming_says_why_and_leaves_a_mode_that_comes_down(
    by: Callable[[Commander], object], text: str, reason: int, comes_down: Mode
) -> None:
    air = Airborne()
    air.commander.change_mode(Mode.MISSION)
    air.commander.change_mode(comes_down)
    air.commander.force_mode(Mode.LAND)
    by(air.commander)
    assert (air.said, air.events) == ([text], [("commander_disarmed_by", reason)])
    assert (air.status.armed, air.flown, air.commander.intended) == (False, (Mode.MISSION, False), Mode.MISSION)


def test_without_a_take_off_it_disarms_after_com_disarm_prflt() -> None:
    air = standing(COM_DISARM_PRFLT=7.0)
    air.commander.arm(force=False)
    assert air.until(air.commander.step, lambda: not air.status.armed) == pytest.approx(7.0, abs=0.03)
    assert (air.said[-1], air.events[-1]) == ("Disarmed by auto preflight disarming", ("commander_disarmed_by", 7))


@pytest.mark.parametrize(("mode", "wait_s"), [(Mode.LAND, 4.0), (Mode.MISSION, 0.02)])
def test_after_a_landing_it_disarms_after_com_disarm_land_a_finished_mission_at_once(mode: Mode, wait_s: float) -> None:
    air = Airborne(COM_DISARM_LAND=4.0)
    air.commander.change_mode(mode)
    air.run(air.commander.step)
    assert (air.said, air.events) == (["Takeoff detected"], [("commander_takeoff_detected",)])
    air.result.finished = True
    air.land()
    assert air.until(air.commander.step, lambda: not air.status.armed) == pytest.approx(wait_s, abs=0.03)
    assert air.said[1:] == ["Landing detected", "Disarmed by landing"]
    assert air.events[1:] == [("commander_landing_detected",), ("commander_disarmed_by", 6)]


def test_a_landing_amid_a_mission_disarms_nobody() -> None:
    air = Airborne()
    air.commander.change_mode(Mode.MISSION)
    air.run(air.commander.step)
    air.land()
    air.run(air.commander.step, 30.0)
    assert air.status.armed


def test_a_reboot_forgets_the_mode_of_before() -> None:
    air = Airborne()
    air.commander.change_mode(Mode.MISSION)
    air.commander.force_mode(Mode.LAND)
    air.run(air.commander.step)
    air.commander.boot()
    assert (air.status.armed, air.flown, air.status.home) == (False, (Mode.LOITER, False), None)
    assert air.status.system_status is SystemStatus.UNINIT
    air.status.armed = True
    air.commander.change_mode(Mode.RTL)
    air.commander.disarm(force=True)
    assert air.status.mode is Mode.LOITER


@pytest.mark.parametrize(("failsafe", "state"), [(True, SystemStatus.CRITICAL), (False, SystemStatus.ACTIVE)])
def test_a_failsafe_shows_as_critical(failsafe: bool, state: SystemStatus) -> None:
    air = Airborne()
    air.status.failsafe = failsafe
    air.commander.step()
    assert air.status.system_status is state


@pytest.mark.parametrize(("good", "state"), [(True, SystemStatus.STANDBY), (False, SystemStatus.UNINIT)])
def test_disarmed_the_checks_show_as_standby(good: bool, state: SystemStatus) -> None:
    air = standing()
    air.status.gps_lost = not good
    air.commander.step()
    assert air.status.system_status is state


# home -------------------------------------------------------------------------------------------------------


def test_home_is_not_set_without_a_position() -> None:
    air = standing(COM_ARM_WO_GPS=1)
    air.status.position_valid = False
    air.state.body.north_m = 30.0
    air.commander.arm(force=True)
    air.commander.step()
    assert air.context.home.north_m == 0.0
    air.status.home = None
    air.commander.step()
    assert air.status.home is None
    air.status.position_valid = True
    air.commander.step()
    assert air.context.home.north_m == 30.0


def test_home_is_known_2_3_seconds_after_power_up() -> None:
    air = standing()
    air.commander.boot()
    for now_s, known in ((2.28, False), (2.3, True)):
        air.clock.now_s = now_s
        air.commander.step()
        assert (air.status.home is not None) is known


@pytest.mark.parametrize(("mode", "sets"), [(Mode.TAKEOFF, True), (Mode.MISSION, False)])
def test_taking_off_sets_home_but_not_in_a_mission_and_landing_never_does(mode: Mode, sets: bool) -> None:
    air = standing()
    air.commander.arm(force=True)
    air.commander.change_mode(mode)
    for landed, north_m in ((False, 7.0), (True, 50.0)):
        air.land(landed)
        air.state.body.north_m = north_m
        air.commander.step()
        assert air.context.home.north_m == (7.0 if sets else 0.0)


@pytest.mark.parametrize(("moved_m", "follows"), [(0.9, False), (1.0, False), (1.1, True)])
def test_home_follows_who_stands_disarmed_more_than_a_metre_away(moved_m: float, follows: bool) -> None:
    air = standing()
    air.state.body.east_m = moved_m
    air.commander.step()
    assert (air.context.home.east_m == moved_m) is follows


@pytest.mark.parametrize(("armed", "landed"), [(True, True), (False, False)])
def test_home_follows_nobody_who_is_armed_or_flies(armed: bool, landed: bool) -> None:
    air = standing()
    air.status.armed = armed
    air.land(landed)
    air.state.body.east_m = 9.0
    air.commander.step()
    assert air.context.home.east_m == 0.0
