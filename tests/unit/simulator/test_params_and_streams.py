"""The PARAM protocol and the message streams, as in scenario 01."""

from __future__ import annotations

import struct

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Result
from tests.support.simulated_vehicle import Cockpit, takeoff, waypoint


@pytest.fixture
def cockpit() -> Cockpit:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    return cockpit


def as_float(value: int) -> float:
    return float(struct.unpack("<f", struct.pack("<i", value))[0])


def as_int(value: float) -> int:
    return int(struct.unpack("<i", struct.pack("<f", value))[0])


def read(cockpit: Cockpit, name: str) -> None:
    cockpit.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))


def test_integers_are_packed_bytewise_and_floats_are_floats(cockpit: Cockpit) -> None:
    read(cockpit, "COM_DL_LOSS_T")
    answer = cockpit.last("PARAM_VALUE")
    assert (answer.param_type, as_int(answer.param_value)) == (6, 10)
    read(cockpit, "NAV_ACC_RAD")
    answer = cockpit.last("PARAM_VALUE")
    assert (answer.param_type, answer.param_value) == (9, 10.0)


@pytest.mark.parametrize("value", [-1, 0, 99, -2147483648, 2147483647, 2143289345])
def test_every_integer_survives_the_float_field_even_those_that_look_like_nan(cockpit: Cockpit, value: int) -> None:
    cockpit.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", as_float(value), 6))
    assert cockpit.vehicle.params["COM_OBL_RC_ACT"] == value
    assert as_int(cockpit.last("PARAM_VALUE").param_value) == value


def test_an_unknown_name_and_a_wrong_type_are_errors(cockpit: Cockpit) -> None:
    read(cockpit, "NO_SUCH_PARAM")
    error = cockpit.last("PARAM_ERROR")
    assert (error.error, error.param_id, error.target_system) == (1, "NO_SUCH_PARAM", 245)
    cockpit.send(mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH_PARAM", 1.0, 9))
    assert cockpit.last("PARAM_ERROR").error == 1
    cockpit.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", 5.0, 9))
    assert cockpit.last("PARAM_ERROR").error == 7
    assert cockpit.vehicle.params["COM_OBL_RC_ACT"] == 0


def test_the_list_is_complete_and_indexed(cockpit: Cockpit) -> None:
    cockpit.send(mavlink.MAVLink_param_request_list_message(1, 1))
    cockpit.fly(1.0)
    hashed, *values = cockpit.messages("PARAM_VALUE", since_s=3.0)
    assert hashed.param_id == "_HASH_CHECK"
    assert [value.param_index for value in values] == list(range(values[0].param_count))
    assert len({value.param_id for value in values}) == values[0].param_count
    cockpit.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 7))
    assert cockpit.last("PARAM_VALUE").param_id == values[7].param_id


def test_parameters_of_another_vehicle_are_none_of_its_business(cockpit: Cockpit) -> None:
    cockpit.send(mavlink.MAVLink_param_set_message(2, 1, b"NAV_ACC_RAD", 3.0, 9))
    assert cockpit.vehicle.params["NAV_ACC_RAD"] == 10.0


def test_an_acceptance_radius_that_is_changed_in_flight_counts_from_then_on() -> None:
    cockpit = Cockpit()
    cockpit.start([takeoff(10), waypoint(100, 0, 10), waypoint(100, 50, 10)])
    cockpit.until(lambda: cockpit.vehicle.store.current_seq == 1)
    cockpit.fly(3.0)
    cockpit.send(mavlink.MAVLink_param_set_message(1, 1, b"NAV_ACC_RAD", 3.0, 9))
    cockpit.until(lambda: cockpit.vehicle.store.current_seq == 2)
    assert cockpit.distance_to(100, 0) < 3.0, "10 m before"


def test_airframes_and_firmware_bring_their_own_parameters() -> None:
    assert Cockpit("plane", ready=False).vehicle.params["MIS_TKO_LAND_REQ"] == 2
    assert "MIS_PD_TO" not in Cockpit(ready=False).vehicle.params
    assert Cockpit(firmware="px4-1.14", ready=False).vehicle.params["MIS_PD_TO"] == 5.0


@pytest.mark.parametrize(
    ("name", "hz"), [("GLOBAL_POSITION_INT", 10), ("HEARTBEAT", 1), ("EXTENDED_SYS_STATE", 5), ("MISSION_CURRENT", 1)]
)
def test_streams_flow_unasked(name: str, hz: float) -> None:
    cockpit = Cockpit(heartbeats=False)
    begin_s = cockpit.now_s
    cockpit.fly(10.0)
    assert len(cockpit.messages(name, begin_s)) == pytest.approx(10 * hz, abs=1)


def test_an_interval_can_be_set_asked_for_and_stopped(cockpit: Cockpit) -> None:
    assert cockpit.command(Cmd.SET_MESSAGE_INTERVAL, 33, 500_000) == [Result.ACCEPTED]
    assert cockpit.command(Cmd.GET_MESSAGE_INTERVAL, 33) == [Result.ACCEPTED]
    assert cockpit.last("MESSAGE_INTERVAL").interval_us == 500_000
    begin_s = cockpit.now_s
    cockpit.fly(5.0)
    assert len(cockpit.messages("GLOBAL_POSITION_INT", begin_s)) == pytest.approx(10, abs=1)
    assert cockpit.command(Cmd.SET_MESSAGE_INTERVAL, 33, -1) == [Result.ACCEPTED]
    begin_s = cockpit.now_s
    cockpit.fly(3.0)
    assert cockpit.messages("GLOBAL_POSITION_INT", begin_s) == []
    assert cockpit.command(Cmd.SET_MESSAGE_INTERVAL, 20_000, 100_000) == [Result.FAILED]


def test_a_requested_message_comes_before_its_ack_and_an_unknown_one_is_denied(cockpit: Cockpit) -> None:
    assert cockpit.command(Cmd.REQUEST_MESSAGE, 148) == [Result.ACCEPTED]
    names = [heard.name for heard in cockpit.heard]
    assert names.index("AUTOPILOT_VERSION") < len(names) - 1 - names[::-1].index("COMMAND_ACK")
    assert cockpit.command(Cmd.REQUEST_MESSAGE, 20_000) == [Result.DENIED]
    assert cockpit.command(Cmd.REQUEST_MESSAGE, 42) == [Result.DENIED]


def test_the_version_tells_the_firmware_and_a_uid_that_is_stable_and_its_own() -> None:
    def version(**options: str) -> tuple[int, int]:
        cockpit = Cockpit(ready=False, **options)  # type: ignore[arg-type]
        cockpit.command(Cmd.REQUEST_MESSAGE, 148)
        message = cockpit.last("AUTOPILOT_VERSION")
        return message.flight_sw_version, message.uid

    assert version() == version()
    assert version()[0] == 18022464
    assert version(firmware="px4-1.14")[0] == (1 << 24 | 14 << 16 | 3 << 8 | 255)


def test_timesync_and_ping_are_answered(cockpit: Cockpit) -> None:
    cockpit.send(mavlink.MAVLink_timesync_message(0, 1234))
    assert cockpit.last("TIMESYNC").ts1 == 1234
    assert cockpit.last("TIMESYNC").tc1 > 0
    cockpit.send(mavlink.MAVLink_ping_message(99, 7, 0, 0))
    assert (cockpit.last("PING").seq, cockpit.last("PING").target_system) == (7, 245)


def test_the_heartbeat_names_type_autopilot_and_mode() -> None:
    for airframe, mav_type in {"quad": 2, "plane": 1, "vtol": 22, "rover": 10, "airship": 7, "hexa": 13}.items():
        heartbeat = Cockpit(airframe).last("HEARTBEAT")
        assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (mav_type, 12, 29)
        assert heartbeat.custom_mode == 50593792


def test_sys_status_tells_when_the_vehicle_can_be_armed() -> None:
    """Scenario 01: the pre-arm check turns healthy with the arming checks."""
    cockpit = Cockpit(ready=False)
    cockpit.fly(6.0)
    shown = [(h.t_s, bool(h.message.onboard_control_sensors_health & 1 << 28)) for h in cockpit.heard
             if h.name == "SYS_STATUS"]  # fmt: skip
    assert max(t_s for t_s, healthy in shown if not healthy) < 4.7 < min(t_s for t_s, healthy in shown if healthy) + 0.2


def test_without_a_position_there_is_no_global_position(cockpit: Cockpit) -> None:
    cockpit.vehicle.faults.gps_lost = True
    cockpit.fly(5.1)  # dead reckoning is over
    begin_s = cockpit.now_s
    cockpit.fly(2.0)
    assert cockpit.messages("GLOBAL_POSITION_INT", begin_s) == []
    assert cockpit.last("GPS_RAW_INT").fix_type == 0


@pytest.mark.parametrize(("rates", "hz"), [("onboard", 51.5), ("low", 10.0)])
def test_the_rates_are_what_is_said_of_them(rates: str, hz: float) -> None:
    """All messages of an idle vehicle a second, MISSION_CURRENT included."""
    cockpit = Cockpit(rates=rates)
    begin_s = cockpit.now_s
    cockpit.fly(20.0)
    assert len([heard for heard in cockpit.heard if heard.t_s >= begin_s]) / 20.0 == pytest.approx(hz, rel=0.03)
