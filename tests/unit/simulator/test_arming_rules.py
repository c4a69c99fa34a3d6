"""Arming, disarming, home and single commands: each rule alone."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Mode, Result
from tests.support.simulated_vehicle import RETURN, GroundStation, do, land, takeoff, waypoint

NAN = math.nan
ARM, DISARM, FORCE = 1, 0, 21196


def arming(gcs: GroundStation, *params: float) -> list[int]:
    return gcs.command(Cmd.COMPONENT_ARM_DISARM, *params)


def airborne(**params: float) -> GroundStation:
    """Holding at 10 m above the start."""
    gcs = GroundStation(params={"MIS_TAKEOFF_ALT": 10.0, **params})
    gcs.command(Cmd.NAV_TAKEOFF, 0, 0, 0, 0, NAN, NAN, NAN)
    gcs.arm()
    gcs.until(lambda: gcs.vehicle.state.status.mode is Mode.LOITER, 40.0)
    gcs.fly(3.0)
    return gcs


# arming -----------------------------------------------------------------------------------------------------


def test_a_force_arms_in_spite_of_the_checks() -> None:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    assert arming(gcs, ARM) == [Result.TEMPORARILY_REJECTED]
    assert arming(gcs, ARM, FORCE) == [Result.ACCEPTED]
    assert gcs.armed


def test_arming_twice_and_disarming_twice_is_accepted() -> None:
    gcs = GroundStation()
    assert [arming(gcs, what) for what in (ARM, ARM, DISARM, DISARM)] == [[Result.ACCEPTED]] * 4


def test_neither_arm_nor_disarm_is_unsupported() -> None:
    assert arming(GroundStation(), 7) == [Result.UNSUPPORTED]


def test_an_empty_battery_does_not_arm() -> None:
    gcs = GroundStation()
    gcs.vehicle.battery.set_fraction(0.04)
    assert arming(gcs, ARM) == [Result.TEMPORARILY_REJECTED]


@pytest.mark.parametrize(
    ("mode", "name"),
    [
        (Mode.MANUAL, "Manual"),
        (Mode.ACRO, "Acro"),
        (Mode.STABILIZED, "Stabilized"),
        (Mode.ALTCTL, "Altitude"),
        (Mode.POSCTL, "Position"),
    ],
)
def test_modes_that_need_sticks_are_not_armed_nor_entered_without_them(mode: Mode, name: str) -> None:
    gcs = GroundStation()
    assert gcs.set_mode(mode) == [Result.ACCEPTED], "disarmed every mode is taken"
    assert arming(gcs, ARM) == [Result.TEMPORARILY_REJECTED]
    flying = airborne()
    assert flying.set_mode(mode) == [Result.TEMPORARILY_REJECTED]
    assert "".join(flying.texts()).endswith(f"Switching to {name} is currently not available")


def test_a_mode_request_without_the_custom_flag_is_refused() -> None:
    assert GroundStation().command(Cmd.DO_SET_MODE, 0, 4, 3) == [Result.TEMPORARILY_REJECTED]


def test_a_mission_start_that_cannot_arm_changes_the_mode_all_the_same() -> None:
    """Recording 26."""
    gcs = GroundStation(params={"NAV_DLL_ACT": 2}, heartbeats=False)
    gcs.upload([takeoff(5), RETURN])
    gcs.fly(0.1)
    assert gcs.command(Cmd.MISSION_START) == [Result.TEMPORARILY_REJECTED]
    assert (gcs.armed, gcs.vehicle.state.status.mode) == (False, Mode.MISSION)


# disarming --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["COM_DISARM_PRFLT", "COM_DISARM_LAND"])
def test_automatic_disarming_can_be_switched_off(name: str) -> None:
    gcs = GroundStation(params={name: 0.0}) if name == "COM_DISARM_PRFLT" else airborne(**{name: 0.0})
    if name == "COM_DISARM_PRFLT":
        gcs.arm()
    else:
        gcs.command(Cmd.NAV_LAND)
        gcs.until(lambda: gcs.vehicle.state.status.landed, 60.0)
    gcs.fly(15.0)
    assert gcs.armed


@pytest.mark.parametrize("wait_s", [2.0, 6.0])
def test_after_a_landing_it_disarms_when_com_disarm_land_is_over(wait_s: float) -> None:
    gcs = airborne(COM_DISARM_LAND=wait_s)
    gcs.command(Cmd.NAV_LAND)
    gcs.until(lambda: gcs.vehicle.state.status.landed, 60.0)
    assert gcs.until(lambda: not gcs.armed, 20.0) == pytest.approx(wait_s, abs=0.1)


def test_a_mission_that_ends_in_a_landing_disarms_at_once() -> None:
    gcs = GroundStation(params={"COM_DISARM_LAND": 6.0})
    gcs.start([takeoff(4), land()])
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 3)
    gcs.until(lambda: gcs.vehicle.state.status.landed, 60.0)
    assert gcs.until(lambda: not gcs.armed, 20.0) < 0.2


def test_home_moves_to_where_it_arms_and_to_where_it_disarms() -> None:
    gcs = GroundStation()
    body = gcs.vehicle.state.body
    for north_m, what in ((5.0, ARM), (9.0, DISARM)):
        body.north_m = north_m
        assert arming(gcs, what) == [Result.ACCEPTED]
        assert gcs.vehicle.context.home.north_m == north_m


def test_a_reboot_is_commanded_by_1_alone_and_disarms() -> None:
    gcs = airborne()
    assert gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 2) == [Result.DENIED]
    gcs.fly(1.0)
    assert gcs.armed
    gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1)
    gcs.fly(0.1)
    assert not gcs.armed


def test_a_reboot_keeps_parameters_and_forgets_the_gripper() -> None:
    gcs = GroundStation()
    gcs.vehicle.params.set("NAV_ACC_RAD", 3.0)
    gcs.command(Cmd.DO_GRIPPER, 1, 0, wait_s=2.0)
    gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1)
    gcs.fly(6.0)
    assert gcs.vehicle.params["NAV_ACC_RAD"] == 3.0
    assert gcs.command(Cmd.DO_GRIPPER, 1, 1) == [Result.ACCEPTED], "it has grabbed"


# commands ---------------------------------------------------------------------------------------------------


def test_takeoff_goes_to_mis_takeoff_alt_or_to_the_altitude_above_the_sea_that_it_names() -> None:
    gcs = airborne(MIS_TAKEOFF_ALT=7.0)
    assert gcs.vehicle.state.body.up_m == pytest.approx(7.0, abs=0.8)
    assert "Using default takeoff altitude: 7.0 m" in gcs.texts()


def reposition(
    gcs: GroundStation, speed: float, flags: int, north_m: float | None, up_m: float, answer: Result = Result.ACCEPTED
) -> None:
    x = y = 2147483647  # "not given"
    if north_m is not None:
        latitude, longitude = gcs.vehicle.spec.frame.to_global(north_m, 0.0)
        x, y = round(latitude * 1e7), round(longitude * 1e7)
    z = gcs.vehicle.spec.frame.altitude_m + up_m
    gcs.send(mavlink.MAVLink_command_int_message(1, 1, 6, Cmd.DO_REPOSITION, 0, 0, speed, flags, 0, 0, x, y, z))
    gcs.fly(0.1)
    assert gcs.last("COMMAND_ACK").result == answer


def test_reposition_changes_the_mode_only_when_its_flag_says_so() -> None:
    """Scenario 22: without the flag it moves a vehicle that holds, and no other."""
    gcs = airborne()
    gcs.vehicle.commander.change_mode(Mode.POSCTL)  # by somebody with sticks
    reposition(gcs, -1, 0, 20.0, 10.0, Result.DENIED)
    assert gcs.vehicle.state.status.mode is Mode.POSCTL
    reposition(gcs, -1, 1, 20.0, 10.0)
    assert gcs.vehicle.state.status.mode is Mode.LOITER


def test_reposition_keeps_the_place_or_the_height_that_it_does_not_name() -> None:
    gcs = airborne()
    reposition(gcs, -1, 1, 15.0, NAN)
    gcs.fly(12.0)
    assert (gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.up_m) == pytest.approx((15, 10), abs=1.0)
    reposition(gcs, -1, 1, None, 14.0)
    gcs.fly(8.0)
    assert (gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.up_m) == pytest.approx((15, 14), abs=1.0)


def test_reposition_brings_its_speed() -> None:
    gcs = airborne()
    reposition(gcs, 1.5, 1, 60.0, 10.0)
    gcs.fly(8.0)
    assert gcs.vehicle.state.body.ground_speed_m_s == pytest.approx(1.5, abs=0.2)


def test_a_speed_of_minus_one_is_the_default_again() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(5), waypoint(200, 0, 5), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 20)
    for speed, flown in ((2.0, 2.0), (-1.0, 5.0)):
        gcs.command(Cmd.DO_CHANGE_SPEED, 1, speed, -1)
        gcs.fly(5.0)
        assert gcs.vehicle.state.body.ground_speed_m_s == pytest.approx(flown, abs=0.6)


def test_a_speed_item_holds_for_the_mission_and_ends_with_it() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(5), do(Cmd.DO_CHANGE_SPEED, 1, 2, -1), waypoint(200, 0, 5), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 20)
    assert gcs.vehicle.state.body.ground_speed_m_s == pytest.approx(2.0, abs=0.2)
    gcs.set_mode(Mode.LOITER)
    gcs.fly(3.0)
    gcs.set_mode(Mode.MISSION)
    gcs.fly(6.0)
    assert gcs.vehicle.state.body.ground_speed_m_s > 4.0, "entered again: the default"


@pytest.mark.parametrize(
    ("airframe", "wanted", "result"),
    [
        ("quad", 4, Result.DENIED),
        ("plane", 3, Result.DENIED),
        ("vtol", NAN, Result.DENIED),
        ("vtol", 4, Result.TEMPORARILY_REJECTED),  # on the ground
        ("vtol", 3, Result.ACCEPTED),
    ],
)
def test_transitions_are_for_vtols_in_the_air(airframe: str, wanted: float, result: Result) -> None:
    assert GroundStation(airframe).command(Cmd.DO_VTOL_TRANSITION, wanted) == [result]
