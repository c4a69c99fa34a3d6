"""pymavlink's own connection, waypoint list and parameter set, with the dialect it is released with."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavparm, mavutil, mavwp

from tests.contract.simulator_clients.waiting import HANG_S, until
from tests.support.simulated import SimulatedFleet

LATITUDE_DEG, LONGITUDE_DEG = 47.397742, 8.545594
INT32, REAL32 = 6, 9
PLAN = """QGC WPL 110
0\t0\t3\t22\t0\t0\t0\tnan\t47.397742\t8.545594\t10\t1
1\t0\t3\t16\t1\t1\t0\tnan\t47.397942\t8.545594\t10\t1
2\t0\t2\t211\t1\t0\t0\t0\t0\t0\t0\t1
3\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


@pytest.fixture(scope="module")
def vehicle() -> Iterator[Any]:
    """A connection that has heard the vehicle and sends heartbeats at 1 Hz whenever it waits."""
    with SimulatedFleet("quad", speed=4.0, rates="onboard", params="RTL_RETURN_ALT=12.0,COM_OF_LOSS_T=5") as fleet:
        port = fleet.connections[0].rpartition(":")[2]
        with mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", dialect="common") as connection:
            assert not hasattr(mavutil.mavlink, "MAVLink_event_message"), "the released dialect, not ours"
            assert connection.wait_heartbeat(timeout=HANG_S) is not None
            yield connection


def received(
    vehicle: Any,
    kind: str,
    wanted: Callable[[Any], bool] = lambda message: True,
    *,
    meanwhile: Callable[[], None] = lambda: None,
) -> Any:
    """The next message of this kind that is `wanted`; keeps the vehicle aware of a ground station.

    `meanwhile` is called several times a second.
    """
    deadline_s, beat_s = time.monotonic() + HANG_S, 0.0
    while time.monotonic() < deadline_s:
        if time.monotonic() >= beat_s:
            beat_s = time.monotonic() + 0.25  # 1 Hz of vehicle time
            vehicle.mav.heartbeat_send(6, 8, 0, 0, 4)
        meanwhile()
        message = vehicle.recv_match(type=kind, blocking=True, timeout=0.1)
        if message is not None and wanted(message):
            return message
    raise AssertionError(f"no {kind} that was waited for within {HANG_S:g} s")


def result_of(vehicle: Any, command: int, *, meanwhile: Callable[[], None] = lambda: None) -> int:
    def is_final(ack: Any) -> bool:
        return bool(ack.command == command and ack.result != 5)

    return int(received(vehicle, "COMMAND_ACK", is_final, meanwhile=meanwhile).result)


def flying_mode(vehicle: Any, name: str) -> None:
    received(vehicle, "HEARTBEAT", lambda beat: beat.get_srcComponent() == 1 and vehicle.flightmode == name)


# missions ---------------------------------------------------------------------------------------------------


def upload(vehicle: Any, plan: mavwp.MAVWPLoader) -> int:
    """The loop that everybody writes with pymavlink: float items, the legacy way, as the list holds them."""
    vehicle.waypoint_count_send(plan.count())
    while True:
        message = received(vehicle, ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])  # type: ignore[arg-type]
        if message.get_type() == "MISSION_ACK":
            return int(message.type)
        vehicle.mav.send(plan.wp(message.seq))


def download(vehicle: Any) -> list[Any]:
    vehicle.waypoint_request_list_send()
    count = received(vehicle, "MISSION_COUNT").count
    items = []
    for seq in range(count):
        vehicle.mav.mission_request_int_send(vehicle.target_system, vehicle.target_component, seq)
        items.append(received(vehicle, "MISSION_ITEM_INT", lambda item, seq=seq: item.seq == seq))  # type: ignore[misc]
    vehicle.mav.mission_ack_send(vehicle.target_system, vehicle.target_component, 0)
    return items


@pytest.fixture
def plan(vehicle: Any, tmp_path: Path) -> mavwp.MAVWPLoader:
    """Read from a file as ground stations write it."""
    file = tmp_path / "plan.waypoints"
    file.write_text(PLAN)
    loader = mavwp.MAVWPLoader(target_system=vehicle.target_system, target_component=vehicle.target_component)
    assert loader.load(str(file)) == 4
    return loader


def test_a_mission_is_uploaded_downloaded_and_cleared(vehicle: Any, plan: mavwp.MAVWPLoader) -> None:
    assert upload(vehicle, plan) == 0
    items = download(vehicle)
    assert [(item.command, item.frame) for item in items] == [(22, 3), (16, 3), (211, 2), (20, 2)]
    assert items[1].x == pytest.approx(47.397942e7, abs=50)  # a float's worth of latitude
    vehicle.waypoint_set_current_send(1)
    received(vehicle, "MISSION_CURRENT", lambda current: current.seq == 1)
    assert vehicle.waypoint_current() == 1
    vehicle.waypoint_clear_all_send()
    assert received(vehicle, "MISSION_ACK").type == 0
    assert download(vehicle) == []


def test_an_item_that_px4_does_not_know_is_refused(vehicle: Any, plan: mavwp.MAVWPLoader) -> None:
    plan.wp(1).command = 42
    assert upload(vehicle, plan) == mavutil.mavlink.MAV_MISSION_UNSUPPORTED


# parameters -------------------------------------------------------------------------------------------------


def test_all_parameters_are_fetched(vehicle: Any) -> None:
    vehicle.param_fetch_all()
    first = received(vehicle, "PARAM_VALUE", lambda value: value.param_index != 65535)
    names = {first.param_id}
    while len(names) < first.param_count:
        names.add(received(vehicle, "PARAM_VALUE").param_id)
    assert {"NAV_ACC_RAD", "COM_OBL_RC_ACT", "MIS_COMMAND_TOUT", "PD_GRIPPER_TO"} <= names
    assert vehicle.param("NAV_ACC_RAD") == 10.0


def test_one_parameter_is_fetched_by_name_and_by_index(vehicle: Any) -> None:
    vehicle.param_fetch_one("NAV_LOITER_RAD")
    value = received(vehicle, "PARAM_VALUE", lambda value: value.param_id == "NAV_LOITER_RAD")
    vehicle.param_fetch_one(value.param_index)
    assert received(vehicle, "PARAM_VALUE").param_id == "NAV_LOITER_RAD"


def test_parameters_are_set_floats_as_such_and_integers_bytewise(vehicle: Any) -> None:
    vehicle.param_set_send("NAV_ACC_RAD", 7.5, REAL32)
    assert received(vehicle, "PARAM_VALUE", lambda value: value.param_id == "NAV_ACC_RAD").param_value == 7.5
    parameters = mavparm.MAVParmDict()
    assert parameters.mavset(vehicle, "COM_OBL_RC_ACT", 5, parm_type=INT32)
    vehicle.param_fetch_one("COM_OBL_RC_ACT")
    value = received(vehicle, "PARAM_VALUE", lambda value: value.param_id == "COM_OBL_RC_ACT")
    assert struct.unpack("<i", struct.pack("<f", value.param_value)) == (5,)


# flying -----------------------------------------------------------------------------------------------------


def armed(vehicle: Any, *, meanwhile: Callable[[], None] = lambda: None) -> None:
    """Arming is denied for some seconds after boot."""

    def is_armable(status: Any) -> bool:
        return bool(status.onboard_control_sensors_health & 1 << 28)

    received(vehicle, "SYS_STATUS", is_armable, meanwhile=meanwhile)
    vehicle.arducopter_arm()
    assert result_of(vehicle, 400, meanwhile=meanwhile) == 0
    received(vehicle, "HEARTBEAT", lambda _: vehicle.motors_armed(), meanwhile=meanwhile)


def landed_and_disarmed(vehicle: Any) -> None:
    received(vehicle, "HEARTBEAT", lambda _: not vehicle.motors_armed())
    received(vehicle, "EXTENDED_SYS_STATE", lambda state: state.landed_state == 1)


def test_a_mission_is_armed_started_and_flown_to_its_end(vehicle: Any, plan: mavwp.MAVWPLoader) -> None:
    assert upload(vehicle, plan) == 0
    received(vehicle, "MISSION_CURRENT", lambda current: current.mission_state == 2)
    armed(vehicle)
    vehicle.set_mode("MISSION")
    assert result_of(vehicle, 176) == 0
    flying_mode(vehicle, "MISSION")
    for seq in (0, 3):  # those between may be reached within one cycle, and then not be said
        received(vehicle, "MISSION_ITEM_REACHED", lambda one, seq=seq: one.seq == seq)  # type: ignore[misc]
    flying_mode(vehicle, "RTL")
    landed_and_disarmed(vehicle)


def test_modes_are_set_by_their_names(vehicle: Any) -> None:
    for name in ("POSCTL", "LOITER", "MISSION", "RTL", "LOITER"):
        vehicle.set_mode(name)
        assert result_of(vehicle, 176) == 0
        flying_mode(vehicle, name)


def test_offboard_takes_off_to_a_setpoint_and_holds_when_the_stream_ends(vehicle: Any) -> None:
    """COM_OBL_RC_ACT is 5."""
    assert mavparm.MAVParmDict().mavset(vehicle, "COM_OBL_RC_ACT", 5, parm_type=INT32)

    def setpoint() -> None:
        vehicle.mav.set_position_target_local_ned_send(
            0, vehicle.target_system, vehicle.target_component, 1, 3576, 10.0, 0.0, -8.0, 0, 0, 0, 0, 0, 0, 0, 0
        )

    setpoint()
    vehicle.set_mode("OFFBOARD")
    assert result_of(vehicle, 176, meanwhile=setpoint) == 0
    armed(vehicle, meanwhile=setpoint)
    beat = iter(range(10**6))

    def there() -> bool:
        if next(beat) % 10 == 0:
            vehicle.mav.heartbeat_send(6, 8, 0, 0, 4)
        setpoint()
        at = vehicle.recv_match(type="LOCAL_POSITION_NED", blocking=True, timeout=0.1)
        return at is not None and abs(at.x - 10.0) < 1.0 and abs(at.z + 8.0) < 1.0

    until(there, "the setpoint must be followed")
    assert vehicle.flightmode == "OFFBOARD"
    flying_mode(vehicle, "LOITER")
    vehicle.set_mode("LAND")
    assert result_of(vehicle, 176) == 0
    landed_and_disarmed(vehicle)


# payload ----------------------------------------------------------------------------------------------------


def test_a_gripper_command_is_in_progress_and_then_accepted(vehicle: Any) -> None:
    for action, name in ((1, "grab"), (0, "release")):
        vehicle.mav.command_long_send(vehicle.target_system, 1, 211, 0, 1, action, 0, 0, 0, 0, 0)
        results = [received(vehicle, "COMMAND_ACK", lambda ack: ack.command == 211).result]
        if results == [5]:
            results.append(result_of(vehicle, 211))
        assert results[-1] == 0, name
    assert results == [5, 0], "it was closed"
