"""GNSS is lost: nothing arms, and what flies comes down where it is (PX4's Descend)."""

from __future__ import annotations

import math

import pytest

from app.simulator.wire import Cmd, LandedState, Mode, Result
from tests.support.offboard_sender import Sender, attitude, local
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff, waypoint

GPS_HEALTH = 0x20
RECKONS_S = 5.0


def lose(gcs: GroundStation, lost: bool = True) -> None:
    gcs.vehicle.faults.gps_lost = lost


def mode(gcs: GroundStation) -> Mode:
    return gcs.vehicle.state.status.mode


def under_way(firmware: str = "px4-main", **params: float) -> GroundStation:
    """A mission's long leg, at 15 m."""
    gcs = GroundStation(params=params, firmware=firmware)
    gcs.start([takeoff(15), waypoint(400, 0, 15), RETURN])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 5)
    return gcs


@pytest.mark.parametrize("lost", [True, False])
def test_sys_status_shows_the_health_of_gnss(lost: bool) -> None:
    gcs = GroundStation(ready=False)
    lose(gcs, lost)
    gcs.fly(2.0)
    assert bool(gcs.last("SYS_STATUS").onboard_control_sensors_health & GPS_HEALTH) is not lost


def test_without_gnss_it_does_not_arm() -> None:
    gcs = GroundStation()
    lose(gcs)
    gcs.fly(0.1)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    lose(gcs, False)
    gcs.fly(0.1)
    gcs.arm()


def test_com_arm_wo_gps_waives_the_fix_and_not_the_position_that_hold_needs() -> None:
    gcs = GroundStation(params={"COM_ARM_WO_GPS": 1})
    lose(gcs)
    gcs.fly(RECKONS_S + 1.0)
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == [Result.TEMPORARILY_REJECTED]
    lose(gcs, False)
    gcs.fly(0.1)
    lose(gcs)
    gcs.fly(0.1)
    gcs.arm()


def test_without_gnss_since_power_up_there_is_no_home() -> None:
    gcs = GroundStation(ready=False)
    lose(gcs)
    gcs.fly(8.0)
    assert gcs.messages("HOME_POSITION") == []
    assert gcs.messages("GLOBAL_POSITION_INT") == []


def test_a_mission_is_flown_for_as_long_as_dead_reckoning_lasts_and_then_it_descends() -> None:
    gcs = under_way()
    lose(gcs)
    assert gcs.until(lambda: mode(gcs) is not Mode.MISSION, 10.0) == pytest.approx(RECKONS_S, abs=0.1)
    gcs.fly(3.0)
    assert (gcs.last("HEARTBEAT").custom_mode, gcs.last("HEARTBEAT").system_status) == (Mode.DESCEND, 5)
    assert gcs.last("EXTENDED_SYS_STATE").landed_state == LandedState.IN_AIR, "Descend is no auto mode"
    assert gcs.texts()[-1] == "Failsafe activated"
    assert gcs.vehicle.state.body.v_up_m_s == pytest.approx(-0.7, abs=0.05), "MPC_LAND_SPEED"
    gcs.until(lambda: not gcs.armed, 60.0)
    assert gcs.vehicle.state.body.up_m == 0.0
    assert gcs.texts()[-1] == "Disarmed by landing"


@pytest.mark.parametrize(("firmware", "sub_mode"), [("px4-main", 20), ("px4-1.14", 6)])
def test_descend_shows_as_sub_mode_20_since_july_2026_and_as_land_before(firmware: str, sub_mode: int) -> None:
    """PR 27918."""
    gcs = under_way(firmware)
    lose(gcs)
    gcs.fly(RECKONS_S + 3.0)
    assert gcs.last("HEARTBEAT").custom_mode == 4 << 16 | sub_mode << 24


def test_nobody_can_command_descend() -> None:
    gcs = under_way()
    assert gcs.command(Cmd.DO_SET_MODE, 1, 4, 20) == [Result.TEMPORARILY_REJECTED]
    assert "Unsupported auto mode" in gcs.texts()
    assert mode(gcs) is Mode.MISSION


def test_a_blind_descent_drifts_with_the_wind() -> None:
    gcs = under_way()
    gcs.set_mode(Mode.LOITER)
    gcs.fly(5.0)
    gcs.vehicle.faults.wind_east_m_s = 4.0
    gcs.fly(5.0)
    body = gcs.vehicle.state.body
    assert abs(body.east_m) < 3.0, "with a position it holds against it"
    lose(gcs)
    gcs.fly(RECKONS_S + 6.0)
    assert body.v_east_m_s == pytest.approx(4.0, abs=0.3)
    assert (body.v_north_m_s, body.roll_rad) == pytest.approx((0.0, 0.0), abs=0.1)


@pytest.mark.parametrize("flown", [Mode.LOITER, Mode.RTL, Mode.LAND, Mode.POSCTL])
def test_no_mode_that_needs_a_position_is_flown_on_or_entered(flown: Mode) -> None:
    gcs = under_way()
    gcs.vehicle.commander.change_mode(flown)
    lose(gcs)
    gcs.fly(RECKONS_S + 1.0)
    assert (mode(gcs), gcs.vehicle.state.status.failsafe) == (Mode.DESCEND, True)
    assert gcs.set_mode(flown) == [Result.TEMPORARILY_REJECTED]
    assert gcs.command(Cmd.NAV_RETURN_TO_LAUNCH) == [Result.TEMPORARILY_REJECTED]
    assert gcs.command(Cmd.NAV_LAND) == [Result.TEMPORARILY_REJECTED]


def test_with_the_position_back_it_goes_on_in_the_mode_that_it_had() -> None:
    gcs = under_way()
    lose(gcs)
    gcs.fly(RECKONS_S + 1.0)
    assert mode(gcs) is Mode.DESCEND
    lose(gcs, False)
    gcs.fly(0.1)
    assert (mode(gcs), gcs.vehicle.state.status.failsafe) == (Mode.MISSION, False)


def test_an_action_of_another_failsafe_is_taken_up_again_too() -> None:
    gcs = under_way(COM_LOW_BAT_ACT=3)
    gcs.vehicle.battery.set_fraction(0.06)
    gcs.fly(5.1)  # COM_FAIL_ACT_T of hold before
    assert mode(gcs) is Mode.RTL
    lose(gcs)
    gcs.fly(RECKONS_S + 1.0)
    lose(gcs, False)
    gcs.fly(0.1)
    assert (mode(gcs), gcs.vehicle.state.status.failsafe) == (Mode.RTL, True)


def test_offboard_by_position_descends_and_by_attitude_flies_on() -> None:
    sender = Sender("quad").airborne()
    sender.to(attitude(0.5), 1.0)
    lose(sender.gcs)
    sender.stream(RECKONS_S + 1.0)
    assert sender.mode is Mode.OFFBOARD
    sender.to(local((0.0, 0.0, -10.0)), 0.5)
    assert sender.mode is Mode.DESCEND
    sender.to(attitude(0.5), 0.5)
    assert sender.mode is Mode.OFFBOARD


def test_a_plane_circles_with_a_fixed_bank_and_then_sinks() -> None:
    sender = Sender("plane", FW_GPSF_LT=10, FW_GPSF_R=15.0).airborne()
    gcs, body = sender.gcs, sender.gcs.vehicle.state.body
    gcs.set_mode(Mode.LOITER)
    gcs.fly(15.0)
    lose(gcs)
    gcs.fly(RECKONS_S + 3.0)
    before_m = body.up_m
    gcs.fly(5.0)
    assert math.degrees(body.roll_rad) == pytest.approx(15.0, abs=0.1)
    assert body.up_m == pytest.approx(before_m, abs=0.5)
    gcs.fly(10.0)
    assert body.v_up_m_s == pytest.approx(-0.5, abs=0.01)


def test_a_vtol_on_its_wing_becomes_a_multicopter_and_comes_down() -> None:
    gcs = GroundStation("vtol", params={"MIS_TKO_LAND_REQ": 0})
    gcs.start([takeoff(20, command=Cmd.NAV_VTOL_TAKEOFF, north_m=100.0), waypoint(800, 0, 20), RETURN])
    gcs.until(lambda: gcs.vehicle.context.flies_like_plane and gcs.vehicle.state.body.north_m > 60.0)
    lose(gcs)
    gcs.fly(RECKONS_S + 8.0)
    assert gcs.vehicle.context.hovers
    assert gcs.vehicle.state.body.v_up_m_s == pytest.approx(-0.7, abs=0.05)


@pytest.mark.parametrize("airframe", ["rover", "airship"])
def test_a_rover_stops_and_an_airship_comes_down(airframe: str) -> None:
    gcs = GroundStation(airframe)
    gcs.start([waypoint(400, 0, 8)] if airframe == "rover" else [takeoff(8), waypoint(400, 0, 8)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 10)
    lose(gcs)
    gcs.fly(RECKONS_S + 4.0)
    body = gcs.vehicle.state.body
    assert body.ground_speed_m_s < 0.1 if airframe == "rover" else body.v_up_m_s < -0.1
