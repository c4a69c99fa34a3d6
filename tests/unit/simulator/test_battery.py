"""The battery: it drains while armed, is announced level by level, and acts as COM_LOW_BAT_ACT says."""

from __future__ import annotations

import pytest

from app.simulator.wire import Cmd, Mode
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff, waypoint

HOLD_S = 5.0
"""COM_FAIL_ACT_T."""


def flying(**params: float) -> GroundStation:
    gcs = GroundStation(params=params)
    gcs.start([takeoff(5), waypoint(250, 0, 5), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 3)
    return gcs


def test_it_drains_while_armed_only() -> None:
    gcs = GroundStation(params={"COM_DISARM_PRFLT": 0.0})
    gcs.fly(30.0)
    assert gcs.vehicle.state.status.battery_fraction == 1.0
    gcs.arm()
    gcs.fly(30.0)
    assert gcs.vehicle.state.status.battery_fraction == pytest.approx(0.98, abs=0.002)
    assert gcs.last("BATTERY_STATUS").battery_remaining == 98


@pytest.mark.parametrize(
    ("fraction", "action", "mode"),
    [
        (0.14, 3, Mode.MISSION),
        (0.06, 0, Mode.MISSION),
        (0.14, 2, Mode.MISSION),
        (0.06, 1, Mode.RTL),
        (0.06, 2, Mode.LAND),
        (0.06, 3, Mode.RTL),
        (0.04, 0, Mode.MISSION),
        (0.04, 1, Mode.RTL),
        (0.04, 2, Mode.LAND),
        (0.04, 3, Mode.LAND),
    ],
)
def test_it_acts_as_com_low_bat_act_says(fraction: float, action: int, mode: Mode) -> None:
    gcs = flying(COM_LOW_BAT_ACT=action)
    gcs.vehicle.battery.set_fraction(fraction)
    gcs.fly(HOLD_S + 0.1)
    assert gcs.vehicle.state.status.mode is mode


@pytest.mark.parametrize(("action", "mode"), [(2, Mode.LAND), (3, Mode.RTL)])
def test_before_it_acts_it_holds_for_com_fail_act_t_with_mission_as_the_intended_mode(action: int, mode: Mode) -> None:
    """Flown with a critical battery."""
    gcs = flying(COM_LOW_BAT_ACT=action)
    status = gcs.vehicle.state.status
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(2.1)
    shown = gcs.last("CURRENT_MODE")
    assert (status.mode, shown.custom_mode, shown.intended_custom_mode) == (Mode.LOITER, Mode.LOITER, Mode.MISSION)
    assert gcs.last("HEARTBEAT").system_status == 5
    assert "Failsafe activated, entering Hold for 5 seconds" in "".join(gcs.texts())
    assert gcs.until(lambda: status.mode is not Mode.LOITER, 10.0) == pytest.approx(HOLD_S - 2.1, abs=0.05)
    assert status.mode is mode


@pytest.mark.parametrize("commanded", [Mode.MISSION, Mode.LOITER])
def test_any_mode_that_is_commanded_during_the_hold_cancels_it(commanded: Mode) -> None:
    """Flown: the mission was flown on with a critical battery; the next level acts again."""
    gcs = flying(COM_LOW_BAT_ACT=3)
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(2.0)
    assert gcs.set_mode(commanded) == [0]
    gcs.fly(10.0)
    assert gcs.vehicle.state.status.mode is commanded
    gcs.vehicle.battery.set_fraction(0.04)
    gcs.fly(HOLD_S + 0.1)
    assert gcs.vehicle.state.status.mode is Mode.LAND


def test_a_worse_level_during_the_hold_acts_at_its_end_and_during_the_action_at_once() -> None:
    for fractions_s in (((0.06, 2.0), (0.04, HOLD_S - 1.9)), ((0.06, HOLD_S + 0.1), (0.04, 0.1))):
        gcs = flying(COM_LOW_BAT_ACT=3)
        for fraction, seconds in fractions_s:
            gcs.vehicle.battery.set_fraction(fraction)
            gcs.fly(seconds)
        assert gcs.vehicle.state.status.mode is Mode.LAND


def test_who_lands_is_not_made_to_return() -> None:
    gcs = flying(COM_LOW_BAT_ACT=3)
    gcs.set_mode(Mode.LAND)
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(1.0)
    assert (gcs.vehicle.state.status.mode, gcs.vehicle.state.status.failsafe) == (Mode.LAND, False)


@pytest.mark.parametrize("fraction", [0.14, 0.06, 0.04])
def test_a_mere_warning_shows_as_critical_too(fraction: float) -> None:
    """PX4's inFailsafe() counts every action but None (flown); no failsafe flies it."""
    gcs = flying(COM_LOW_BAT_ACT=0)
    gcs.fly(1.1)
    assert gcs.last("HEARTBEAT").system_status == 4
    gcs.vehicle.battery.set_fraction(fraction)
    gcs.fly(2.1)
    beat, mode = gcs.last("HEARTBEAT"), gcs.last("CURRENT_MODE")
    assert (beat.system_status, beat.custom_mode, mode.intended_custom_mode) == (5, Mode.MISSION, Mode.MISSION)
    assert not gcs.vehicle.state.status.failsafe


def test_it_stays_a_warning_after_a_user_took_over_and_until_the_vehicle_is_disarmed() -> None:
    gcs = flying(COM_LOW_BAT_ACT=3)
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(0.5)
    assert gcs.set_mode(Mode.LAND) == [0]
    gcs.vehicle.battery.set_fraction(0.5)  # armed, PX4's level only rises
    gcs.fly(2.1)
    assert (gcs.last("HEARTBEAT").system_status, gcs.last("HEARTBEAT").custom_mode) == (5, Mode.LAND)
    gcs.until(lambda: not gcs.armed, 60.0)
    gcs.fly(1.1)
    assert gcs.last("HEARTBEAT").system_status == 3


@pytest.mark.parametrize(("emergency", "mode"), [(0.05, Mode.RTL), (0.3, Mode.LAND)])
def test_its_levels_are_parameters(emergency: float, mode: Mode) -> None:
    gcs = flying(COM_LOW_BAT_ACT=3, BAT_LOW_THR=0.4, BAT_CRIT_THR=0.3, BAT_EMERGEN_THR=emergency)
    gcs.vehicle.battery.set_fraction(0.29)
    gcs.fly(HOLD_S + 0.1)
    assert gcs.vehicle.state.status.mode is mode


def test_each_level_is_said_once() -> None:
    gcs = flying()
    for fraction in (0.14, 0.13, 0.06, 0.055, 0.04, 0.03):
        gcs.vehicle.battery.set_fraction(fraction)
        gcs.fly(1.0)
    said = [text for text in gcs.texts() if text.endswith("battery level")]
    assert said == ["Low battery level", "Critical battery level", "Emergency battery level"]


def test_on_the_ground_it_says_so_and_stays() -> None:
    gcs = GroundStation(params={"COM_LOW_BAT_ACT": 3, "COM_DISARM_PRFLT": 0.0})
    gcs.arm()
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(0.5)
    assert "Critical battery level" in gcs.texts()
    assert gcs.vehicle.state.status.mode is Mode.LOITER


def test_what_was_said_on_the_ground_acts_once_in_the_air() -> None:
    gcs = GroundStation(params={"COM_LOW_BAT_ACT": 3, "COM_DISARM_PRFLT": 0.0, "COM_FAIL_ACT_T": 0.0})
    gcs.upload([takeoff(5), waypoint(250, 0, 5), RETURN])
    gcs.fly(1.0)
    gcs.arm()
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(0.5)
    assert gcs.set_mode(Mode.MISSION) == [0]
    assert gcs.vehicle.state.status.mode is Mode.MISSION
    gcs.until(lambda: not gcs.vehicle.state.status.landed, 20.0)
    gcs.fly(0.1)
    assert gcs.vehicle.state.status.mode is Mode.RTL
    gcs.vehicle.commander.change_mode(Mode.LOITER)
    gcs.fly(0.5)
    assert gcs.vehicle.state.status.mode is Mode.LOITER, "once"


def test_a_level_that_was_there_when_it_was_armed_by_force_is_only_said() -> None:
    gcs = GroundStation(params={"COM_LOW_BAT_ACT": 2, "COM_DISARM_PRFLT": 0.0, "MIS_TAKEOFF_ALT": 5.0})
    gcs.vehicle.battery.set_fraction(0.068)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1, 21196) == [0]
    gcs.set_mode(Mode.TAKEOFF)
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 3.0, 30.0)
    assert gcs.vehicle.state.status.mode is not Mode.LAND
    gcs.vehicle.battery.set_fraction(0.04)
    gcs.fly(HOLD_S + 0.1)
    assert gcs.vehicle.state.status.mode is Mode.LAND, "a worse one acts"


@pytest.mark.parametrize(("critical", "fraction", "arms"), [(0.07, 0.08, True), (0.07, 0.06, False), (0.3, 0.2, False)])
def test_it_does_not_arm_from_the_critical_level_on(critical: float, fraction: float, arms: bool) -> None:
    gcs = GroundStation(params={"BAT_CRIT_THR": critical, "BAT_LOW_THR": 0.4})
    gcs.vehicle.battery.set_fraction(fraction)
    assert (gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [0]) is arms
