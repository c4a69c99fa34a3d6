"""mavsdk's own plugins, as they are in the package, against the simulated vehicles over UDP."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from mavsdk.component_type import ComponentType
from mavsdk.connection_result import ConnectionResult
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins.action.action import Action, ActionError
from mavsdk.plugins.geofence.geofence import FenceType, Geofence, GeofenceData, Point, Polygon
from mavsdk.plugins.gripper.gripper import Gripper, GripperResult
from mavsdk.plugins.info.info import Info
from mavsdk.plugins.mission_raw.mission_raw import MissionItem, MissionRaw, MissionRawError, MissionRawResult
from mavsdk.plugins.offboard.offboard import (
    Attitude,
    Offboard,
    OffboardError,
    OffboardResult,
    PositionGlobalYaw,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.plugins.param.param import Param, ParamError, ParamResult
from mavsdk.plugins.telemetry.telemetry import FlightMode, LandedState, Telemetry
from mavsdk.plugins.winch.winch import Winch, WinchResult
from mavsdk.system import System

from tests.contract.simulator_clients.waiting import until
from tests.support.simulated import SimulatedFleet

LATITUDE_DEG, LONGITUDE_DEG, GROUND_AMSL_M = 47.397742, 8.545594, 488.0
RELATIVE, WITHOUT_POSITION = 6, 2
TAKEOFF, WAYPOINT, GRIPPER, RETURN = 22, 16, 211, 20


@pytest.fixture(scope="module")
def system() -> Iterator[System]:
    """One multicopter with a winch, four times as fast as the wall clock, found by one mavsdk."""
    with SimulatedFleet("quad:winch=1", speed=4.0, rates="onboard", params="RTL_RETURN_ALT=12.0") as fleet:
        mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        assert mavsdk.add_any_connection(fleet.connections[0]) is ConnectionResult.SUCCESS
        found = mavsdk.first_autopilot(30.0)
        assert found is not None
        yield found
        mavsdk.destroy()


@pytest.fixture(scope="module")
def telemetry(system: System) -> Telemetry:
    return Telemetry(system)


@pytest.fixture(scope="module")
def gripper(system: System) -> Gripper:
    """It outlives its test: destroyed while a callback of it returns, a plugin takes the process with it."""
    return Gripper(system)


@pytest.fixture(scope="module")
def winch(system: System) -> Winch:
    """As `gripper`."""
    return Winch(system)


@pytest.fixture
def flying(system: System, telemetry: Telemetry) -> Iterator[Action]:
    """In the air, taken off by the plugin; landed and disarmed again afterwards."""
    action = Action(system)
    until(telemetry.health_all_ok, "the vehicle must be healthy")
    until(lambda: telemetry.health().is_armable, "the vehicle must become armable")
    action.set_takeoff_altitude(8.0)
    action.arm()
    action.takeoff()
    until(lambda: telemetry.flight_mode() is FlightMode.HOLD and height_m(telemetry) > 7.0, "the takeoff must end")
    yield action
    action.land()
    until(lambda: not telemetry.armed(), "the vehicle must disarm after landing")
    assert telemetry.landed_state() is LandedState.ON_GROUND


def height_m(telemetry: Telemetry) -> float:
    return float(telemetry.position().relative_altitude_m)


def near(telemetry: Telemetry, north_m: float, east_m: float, within_m: float = 2.0) -> Callable[[], bool]:
    def there() -> bool:
        at = telemetry.position_velocity_ned().position
        return math.hypot(at.north_m - north_m, at.east_m - east_m) < within_m

    return there


def item(seq: int, command: int, *params: float, north_m: float | None = None, up_m: float = 0.0) -> MissionItem:
    p = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    if north_m is None:
        return MissionItem(seq, WITHOUT_POSITION, command, int(seq == 0), 1, *p, 0, 0, 0.0, 0)
    x, y = round((LATITUDE_DEG + north_m / 111_195) * 1e7), round(LONGITUDE_DEG * 1e7)
    return MissionItem(seq, RELATIVE, command, int(seq == 0), 1, *p[:3], math.nan, x, y, up_m, 0)


DELIVERY = [
    item(0, TAKEOFF, north_m=0, up_m=10.0),
    item(1, WAYPOINT, 1.0, 1.0, north_m=25, up_m=10.0),
    item(2, GRIPPER, 1.0, 0.0),
    item(3, RETURN),
]


def contents(items: list[MissionItem]) -> list[tuple[Any, ...]]:
    """Everything but `current`, comparable although it has NaN."""
    names = ("seq", "frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")
    return [tuple(repr(getattr(one, name)) for name in names) for one in items]


def finished(ask: Callable[..., None], *arguments: Any) -> list[Any]:
    """All results of an asynchronous call. mavsdk tells IN_PROGRESS too, as UNKNOWN, before the final one."""
    results: list[Any] = []
    ask(*arguments, lambda result, _: results.append(result))
    until(lambda: results and results[-1].name != "UNKNOWN", f"{ask.__name__} must be answered; told: {results}")
    return results


# missions ---------------------------------------------------------------------------------------------------


def test_a_mission_is_uploaded_downloaded_and_cleared(system: System) -> None:
    missions = MissionRaw(system)
    missions.upload_mission(DELIVERY)
    assert contents(missions.download_mission()) == contents(DELIVERY)
    missions.set_current_mission_item(2)
    until(lambda: missions.mission_progress().current == 2, "the current item must show")
    missions.clear_mission()
    assert missions.download_mission() == []


def test_an_item_that_px4_does_not_know_is_refused(system: System) -> None:
    missions = MissionRaw(system)
    with pytest.raises(MissionRawError) as refused:
        missions.upload_mission([DELIVERY[0], item(1, 42)])
    assert refused.value.result is MissionRawResult.UNSUPPORTED


def test_fence_and_rally_points_go_up_and_come_down(system: System) -> None:
    missions = MissionRaw(system)
    far_deg = 0.005
    corners = [
        Point(LATITUDE_DEG + far_deg * north, LONGITUDE_DEG + far_deg * east)
        for north, east in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    fence = Geofence(system)
    fence.upload_geofence(GeofenceData([Polygon(corners, FenceType.INCLUSION)], []))
    assert [one.command for one in missions.download_geofence()] == [5001] * 4
    fence.clear_geofence()
    assert missions.download_geofence() == []
    x, y = round(LATITUDE_DEG * 1e7), round(LONGITUDE_DEG * 1e7)
    missions.upload_rally_points([MissionItem(0, RELATIVE, 5100, 1, 1, 0.0, 0.0, 0.0, 0.0, x, y, 20.0, 2)])
    assert [one.command for one in missions.download_rallypoints()] == [5100]


def test_a_mission_is_flown_paused_and_goes_on(system: System, telemetry: Telemetry) -> None:
    missions, action = MissionRaw(system), Action(system)
    missions.upload_mission(DELIVERY)
    until(lambda: telemetry.health().is_armable, "the vehicle must become armable")
    action.arm()
    missions.start_mission()
    until(lambda: missions.mission_progress().current >= 1, "the takeoff item must be reached")
    missions.pause_mission()
    until(lambda: telemetry.flight_mode() is FlightMode.HOLD, "a pause must hold")
    missions.start_mission()
    until(lambda: telemetry.flight_mode() is FlightMode.RETURN_TO_LAUNCH, "the mission must end in its return")
    until(lambda: not telemetry.armed(), "the vehicle must land at home and disarm", 60.0)


# parameters -------------------------------------------------------------------------------------------------


def test_parameters_are_read_set_and_listed(system: System) -> None:
    params = Param(system)
    params.set_param_float("NAV_ACC_RAD", 7.5)
    params.set_param_int("COM_OBL_RC_ACT", 5)
    assert (params.get_param_float("NAV_ACC_RAD"), params.get_param_int("COM_OBL_RC_ACT")) == (7.5, 5)
    everything = params.get_all_params()
    assert {"COM_OBL_RC_ACT", "NAV_DLL_ACT"} <= {one.name for one in everything.int_params}
    assert ("NAV_ACC_RAD", 7.5) in [(one.name, one.value) for one in everything.float_params]


def test_a_parameter_that_is_not_there_or_of_another_type_is_an_error(system: System) -> None:
    params = Param(system)
    with pytest.raises(ParamError) as unknown:
        params.get_param_float("NO_SUCH_PARAM")
    assert unknown.value.result is ParamResult.DOES_NOT_EXIST
    with pytest.raises(ParamError) as typed:
        params.set_param_int("NAV_ACC_RAD", 3)
    assert typed.value.result is ParamResult.TYPE_MISMATCH


# telemetry and actions --------------------------------------------------------------------------------------


def test_who_and_what_the_vehicle_is(system: System) -> None:
    info = Info(system)
    version, identification = info.get_version(), info.get_identification()
    assert (version.flight_sw_major, version.flight_sw_minor, version.flight_sw_patch) == (1, 19, 0)
    assert identification.legacy_uid != 0


def test_telemetry_is_complete_and_its_rates_can_be_set(system: System, telemetry: Telemetry) -> None:
    until(telemetry.health_all_ok, "position and home must be told")
    telemetry.set_rate_position(20.0)
    assert telemetry.position().latitude_deg == pytest.approx(LATITUDE_DEG, abs=1e-3)
    assert telemetry.home().absolute_altitude_m == pytest.approx(GROUND_AMSL_M, abs=1.0)
    assert telemetry.battery().remaining_percent > 50.0
    assert telemetry.landed_state() is LandedState.ON_GROUND


def test_goto_goes_there_return_comes_back(flying: Action, telemetry: Telemetry) -> None:
    north_deg = 20.0 / 111_195
    flying.goto_location(LATITUDE_DEG + north_deg, LONGITUDE_DEG, GROUND_AMSL_M + 10.0, math.nan)
    until(near(telemetry, 20.0, 0.0), "the vehicle must go there")
    flying.set_current_speed(2.0)
    flying.hold()
    flying.return_to_launch()
    until(lambda: telemetry.flight_mode() is FlightMode.RETURN_TO_LAUNCH, "the vehicle must return")


def test_in_the_air_it_is_not_disarmed(flying: Action, telemetry: Telemetry) -> None:
    with pytest.raises(ActionError):
        flying.disarm()
    assert telemetry.armed()


# offboard ---------------------------------------------------------------------------------------------------


def starts(offboard: Offboard) -> bool:
    """PX4 looks ten times a second whether there is a stream, and denies the mode until it has seen it."""
    try:
        offboard.start()
    except OffboardError as error:
        if error.result is not OffboardResult.COMMAND_DENIED:
            raise
        return False
    return True


def test_offboard_streams_are_followed_until_they_are_stopped(
    system: System, flying: Action, telemetry: Telemetry
) -> None:
    offboard = Offboard(system)
    with pytest.raises(OffboardError) as nothing:
        offboard.start()
    assert nothing.value.result is OffboardResult.NO_SETPOINT_SET
    offboard.set_position_ned(PositionNedYaw(15.0, 0.0, -12.0, 0.0))
    until(lambda: starts(offboard), "the stream must be seen")
    assert offboard.is_active()
    until(near(telemetry, 15.0, 0.0), "the position must be followed")
    assert telemetry.flight_mode() is FlightMode.OFFBOARD
    offboard.set_velocity_ned(VelocityNedYaw(0.0, 2.0, 0.0, 0.0))
    until(lambda: telemetry.velocity_ned().east_m_s > 1.5, "the velocity must be followed")
    offboard.set_velocity_body(VelocityBodyYawspeed(0.0, 0.0, 0.0, 0.0))
    until(lambda: abs(telemetry.velocity_ned().east_m_s) < 0.3, "no velocity must stop it")
    above_home = PositionGlobalYaw.AltitudeType.REL_HOME
    offboard.set_position_global(PositionGlobalYaw(LATITUDE_DEG, LONGITUDE_DEG, 14.0, 0.0, above_home))
    until(near(telemetry, 0.0, 0.0), "the global position must be followed")
    offboard.set_attitude(Attitude(0.0, 0.0, 0.0, 0.6))
    until(lambda: height_m(telemetry) > 15.0, "thrust must lift it")
    offboard.stop()
    until(lambda: telemetry.flight_mode() is FlightMode.HOLD, "the end of offboard must hold")


# payload ----------------------------------------------------------------------------------------------------


def test_the_gripper_plugin_hears_the_timer_of_the_payload_deliverer(gripper: Gripper) -> None:
    finished(gripper.grab_async, 1)
    assert finished(gripper.release_async, 1) == [GripperResult.UNKNOWN, GripperResult.SUCCESS]
    assert finished(gripper.release_async, 1) == [GripperResult.SUCCESS], "it is released already"


def test_the_winch_plugin_is_answered_by_the_winch_itself(winch: Winch) -> None:
    """The plugin leaves the parameters it does not use NaN."""
    assert finished(winch.relative_length_control_async, 1, 3.0, 2.0)[-1] is WinchResult.SUCCESS
    until(lambda: winch.status().line_length_m == pytest.approx(3.0, abs=0.1), "the line must be let out")
    assert finished(winch.retract_async, 1)[-1] is WinchResult.SUCCESS
    assert finished(winch.lock_async, 1) == [WinchResult.SUCCESS]
    until(lambda: winch.status().status_flags.locked, "the lock must show")
    assert finished(winch.deliver_async, 1) == [WinchResult.UNKNOWN, WinchResult.SUCCESS]
    until(lambda: winch.status().status_flags.fully_retracted, "a delivery must end retracted")
    assert not math.isnan(winch.status().line_length_m)
