"""Which mode can run and be armed for, and the warning that one cannot: each condition alone, without a flight."""

from __future__ import annotations

import pytest

from app.simulator.failsafes import ModeWarning
from app.simulator.wire import Mode
from tests.support.airborne_vehicle import Airborne

AUTO = (Mode.MISSION, Mode.LOITER, Mode.RTL, Mode.LAND, Mode.TAKEOFF, Mode.ORBIT)
STICKS = (Mode.MANUAL, Mode.ALTCTL, Mode.ACRO, Mode.STABILIZED)
"""Those that need no position."""


def standing(**params: float) -> Airborne:
    """Disarmed, and all is well."""
    air = Airborne(**params)
    air.status.armed = False
    air.land()
    assert air.checks.may_arm(Mode.LOITER)
    return air


@pytest.mark.parametrize("mode", AUTO)
def test_autopilot_modes_need_a_position(mode: Mode) -> None:
    air = Airborne()
    assert air.checks.can_run(mode)
    air.status.position_valid = False
    assert not air.checks.can_run(mode)


def test_mission_mode_needs_a_mission_that_is_valid() -> None:
    air = Airborne()
    air.result.valid = False
    assert [mode for mode in AUTO if not air.checks.can_run(mode)] == [Mode.MISSION]


@pytest.mark.parametrize("mode", STICKS)
def test_of_the_modes_with_sticks_these_are_possible_without_a_position(mode: Mode) -> None:
    air = Airborne()
    air.status.position_valid = False
    assert (air.checks.is_possible(mode), air.checks.can_run(mode)) == (True, False)


def test_position_mode_is_possible_with_a_position_only() -> None:
    air = Airborne()
    assert (air.checks.is_possible(Mode.POSCTL), air.checks.can_run(Mode.POSCTL)) == (True, False)
    air.status.position_valid = False
    assert not air.checks.is_possible(Mode.POSCTL)


def test_termination_can_always_run() -> None:
    air = Airborne()
    air.status.position_valid = False
    assert air.checks.can_run(Mode.TERMINATION)


def test_offboard_needs_a_stream_and_unless_it_flies_by_attitude_a_position() -> None:
    air = Airborne()
    assert not air.checks.can_run(Mode.OFFBOARD)
    air.stream_position()
    assert air.checks.can_run(Mode.OFFBOARD)
    air.status.position_valid = False
    assert not air.checks.can_run(Mode.OFFBOARD)
    air.stream_attitude()
    assert air.checks.can_run(Mode.OFFBOARD)


def test_only_termination_and_offboard_by_attitude_fly_blind() -> None:
    air = Airborne()
    air.stream_attitude()
    blind = []
    for mode in Mode:
        air.status.mode = mode
        blind += [mode] if air.checks.flies_blind else []
    assert blind == [Mode.OFFBOARD, Mode.TERMINATION]
    air.stream_position()
    air.status.mode = Mode.OFFBOARD
    assert not air.checks.flies_blind


# arming -----------------------------------------------------------------------------------------------------


def test_without_home_nothing_arms() -> None:
    air = standing()
    air.status.home = None
    assert not air.checks.may_arm(Mode.LOITER)


@pytest.mark.parametrize(("now_s", "armable"), [(4.58, False), (4.6, True)])
def test_the_checks_need_their_time_after_power_up(now_s: float, armable: bool) -> None:
    air = standing()
    air.clock.restart()
    air.clock.now_s = now_s
    assert air.checks.may_arm(Mode.LOITER) is armable


@pytest.mark.parametrize(("waived", "armable"), [(0, False), (1, True)])
def test_a_fix_is_needed_unless_com_arm_wo_gps_waives_it(waived: int, armable: bool) -> None:
    air = standing(COM_ARM_WO_GPS=waived)
    air.status.gps_lost = True
    assert air.checks.may_arm(Mode.LOITER) is armable


@pytest.mark.parametrize(("action", "armable"), [(0, True), (1, False), (2, False)])
def test_a_ground_station_is_needed_where_its_loss_has_an_action(action: int, armable: bool) -> None:
    air = standing(NAV_DLL_ACT=action)
    air.status.gcs_lost = True
    assert air.checks.may_arm(Mode.LOITER) is armable


@pytest.mark.parametrize(("fraction", "armable"), [(0.07, False), (0.08, True)])
def test_the_battery_has_to_be_above_bat_crit_thr(fraction: float, armable: bool) -> None:
    air = standing()
    air.status.battery_fraction = fraction
    assert air.checks.may_arm(Mode.LOITER) is armable


def test_nothing_arms_beyond_the_fence_or_for_a_mode_that_cannot_run() -> None:
    air = standing()
    assert not air.checks.may_arm(Mode.OFFBOARD)
    assert not air.checks.may_arm(Mode.POSCTL)
    air.status.fence_breached = True
    assert not air.checks.may_arm(Mode.LOITER)


# the warning ------------------------------------------------------------------------------------------------


def warned(air: Airborne) -> list[tuple[object, ...]]:
    return [event for event in air.events if event[0] == "commander_failsafe_enter_generic_warn"]


def test_it_is_said_when_the_wanted_mode_becomes_impossible_and_not_in_the_first_moment() -> None:
    air = standing()
    air.status.position_valid = False
    warning = ModeWarning(air.status, air.commander, air.checks, air.event)
    air.run(warning.step, 1.0)
    assert warned(air) == []
    air.status.position_valid = True
    air.run(warning.step)
    air.status.position_valid = False
    air.run(warning.step, 1.0)
    assert warned(air) == [("commander_failsafe_enter_generic_warn", Mode.LOITER)]
    air.status.position_valid = True
    air.run(warning.step)
    warning.boot()
    air.status.position_valid = False
    air.run(warning.step)
    assert len(warned(air)) == 1, "power-up again"


def test_armed_it_is_a_failsafes_business() -> None:
    air = Airborne()
    warning = ModeWarning(air.status, air.commander, air.checks, air.event)
    air.run(warning.step)
    air.status.position_valid = False
    air.run(warning.step)
    assert warned(air) == []


def test_a_failsafe_that_has_flown_has_said_it() -> None:
    air = Airborne()
    warning = ModeWarning(air.status, air.commander, air.checks, air.event)
    air.status.failsafe = True
    air.run(warning.step)
    air.status.armed = air.status.failsafe = air.status.position_valid = False
    air.run(warning.step, 1.0)
    assert warned(air) == []
