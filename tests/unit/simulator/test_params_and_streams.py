"""The PARAM protocol and the message streams, as in scenario 01."""

from __future__ import annotations

import struct

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, Result
from tests.support.simulated_vehicle import GroundStation, takeoff, waypoint


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


def as_float(value: int) -> float:
    return float(struct.unpack("<f", struct.pack("<i", value))[0])


def as_int(value: float) -> int:
    return int(struct.unpack("<i", struct.pack("<f", value))[0])


def read(gcs: GroundStation, name: str) -> None:
    gcs.send(mavlink.MAVLink_param_request_read_message(1, 1, name.encode(), -1))


def test_integers_are_packed_bytewise_and_floats_are_floats(gcs: GroundStation) -> None:
    read(gcs, "COM_DL_LOSS_T")
    answer = gcs.last("PARAM_VALUE")
    assert (answer.param_type, as_int(answer.param_value)) == (6, 10)
    read(gcs, "NAV_ACC_RAD")
    answer = gcs.last("PARAM_VALUE")
    assert (answer.param_type, answer.param_value) == (9, 10.0)


@pytest.mark.parametrize("value", [-1, 0, 99, -2147483648, 2147483647, 2143289345])
def test_every_integer_survives_the_float_field_even_those_that_look_like_nan(gcs: GroundStation, value: int) -> None:
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", as_float(value), 6))
    assert gcs.vehicle.params["COM_OBL_RC_ACT"] == value
    assert as_int(gcs.last("PARAM_VALUE").param_value) == value


def test_an_unknown_name_and_a_wrong_type_are_errors(gcs: GroundStation) -> None:
    read(gcs, "NO_SUCH_PARAM")
    error = gcs.last("PARAM_ERROR")
    assert (error.error, error.param_id, error.target_system) == (1, "NO_SUCH_PARAM", 245)
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"NO_SUCH_PARAM", 1.0, 9))
    assert gcs.last("PARAM_ERROR").error == 1
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"COM_OBL_RC_ACT", 5.0, 9))
    assert gcs.last("PARAM_ERROR").error == 7
    assert gcs.vehicle.params["COM_OBL_RC_ACT"] == 0


def test_the_list_is_complete_and_indexed(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_param_request_list_message(1, 1))
    gcs.fly(1.0)
    hashed, *values = gcs.messages("PARAM_VALUE", since_s=3.0)
    assert hashed.param_id == "_HASH_CHECK"
    assert [value.param_index for value in values] == list(range(values[0].param_count))
    assert len({value.param_id for value in values}) == values[0].param_count
    gcs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", 7))
    assert gcs.last("PARAM_VALUE").param_id == values[7].param_id


def test_parameters_of_another_vehicle_are_none_of_its_business(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_param_set_message(2, 1, b"NAV_ACC_RAD", 3.0, 9))
    assert gcs.vehicle.params["NAV_ACC_RAD"] == 10.0


def test_an_acceptance_radius_that_is_changed_in_flight_counts_from_then_on() -> None:
    gcs = GroundStation()
    gcs.start([takeoff(10), waypoint(100, 0, 10), waypoint(100, 50, 10)])
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1)
    gcs.fly(3.0)
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"NAV_ACC_RAD", 3.0, 9))
    gcs.until(lambda: gcs.vehicle.store.current_seq == 2)
    assert gcs.distance_to(100, 0) < 3.0, "10 m before"


def test_airframes_and_firmware_bring_their_own_parameters() -> None:
    assert GroundStation("plane", ready=False).vehicle.params["MIS_TKO_LAND_REQ"] == 2
    assert "MIS_PD_TO" not in GroundStation(ready=False).vehicle.params
    assert GroundStation(firmware="px4-1.14", ready=False).vehicle.params["MIS_PD_TO"] == 5.0


@pytest.mark.parametrize(
    ("name", "hz"), [("GLOBAL_POSITION_INT", 10), ("HEARTBEAT", 1), ("EXTENDED_SYS_STATE", 5), ("MISSION_CURRENT", 1)]
)
def test_streams_flow_unasked(name: str, hz: float) -> None:
    gcs = GroundStation(heartbeats=False)
    begin_s = gcs.now_s
    gcs.fly(10.0)
    assert len(gcs.messages(name, begin_s)) == pytest.approx(10 * hz, abs=1)


def test_an_interval_can_be_set_asked_for_and_stopped(gcs: GroundStation) -> None:
    assert gcs.command(Cmd.SET_MESSAGE_INTERVAL, 33, 500_000) == [Result.ACCEPTED]
    assert gcs.command(Cmd.GET_MESSAGE_INTERVAL, 33) == [Result.ACCEPTED]
    assert gcs.last("MESSAGE_INTERVAL").interval_us == 500_000
    begin_s = gcs.now_s
    gcs.fly(5.0)
    assert len(gcs.messages("GLOBAL_POSITION_INT", begin_s)) == pytest.approx(10, abs=1)
    assert gcs.command(Cmd.SET_MESSAGE_INTERVAL, 33, -1) == [Result.ACCEPTED]
    begin_s = gcs.now_s
    gcs.fly(3.0)
    assert gcs.messages("GLOBAL_POSITION_INT", begin_s) == []
    assert gcs.command(Cmd.SET_MESSAGE_INTERVAL, 20_000, 100_000) == [Result.FAILED]


def test_a_requested_message_comes_before_its_ack_and_an_unknown_one_is_denied(gcs: GroundStation) -> None:
    assert gcs.command(Cmd.REQUEST_MESSAGE, 148) == [Result.ACCEPTED]
    names = [received.name for received in gcs.received]
    assert names.index("AUTOPILOT_VERSION") < len(names) - 1 - names[::-1].index("COMMAND_ACK")
    assert gcs.command(Cmd.REQUEST_MESSAGE, 20_000) == [Result.DENIED]
    assert gcs.command(Cmd.REQUEST_MESSAGE, 42) == [Result.DENIED]


def test_the_version_tells_the_firmware_and_a_uid_that_is_stable_and_its_own() -> None:
    def version(**options: str) -> tuple[int, int]:
        gcs = GroundStation(ready=False, **options)  # type: ignore[arg-type]
        gcs.command(Cmd.REQUEST_MESSAGE, 148)
        message = gcs.last("AUTOPILOT_VERSION")
        return message.flight_sw_version, message.uid

    assert version() == version()
    assert version()[0] == 18022464
    assert version(firmware="px4-1.14")[0] == (1 << 24 | 14 << 16 | 3 << 8 | 255)


def test_timesync_and_ping_are_answered(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_timesync_message(0, 1234))
    assert gcs.last("TIMESYNC").ts1 == 1234
    assert gcs.last("TIMESYNC").tc1 > 0
    gcs.send(mavlink.MAVLink_ping_message(99, 7, 0, 0))
    assert (gcs.last("PING").seq, gcs.last("PING").target_system) == (7, 245)


def test_the_heartbeat_names_type_autopilot_and_mode() -> None:
    for airframe, mav_type in {"quad": 2, "plane": 1, "vtol": 22, "rover": 10, "airship": 7, "hexa": 13}.items():
        heartbeat = GroundStation(airframe).last("HEARTBEAT")
        assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (mav_type, 12, 29)
        assert heartbeat.custom_mode == 50593792


def test_sys_status_tells_when_the_vehicle_can_be_armed() -> None:
    """Scenario 01: the pre-arm check turns healthy with the arming checks."""
    gcs = GroundStation(ready=False)
    gcs.fly(6.0)
    shown = [(h.t_s, bool(h.message.onboard_control_sensors_health & 1 << 28)) for h in gcs.received
             if h.name == "SYS_STATUS"]  # fmt: skip
    assert max(t_s for t_s, healthy in shown if not healthy) < 4.7 < min(t_s for t_s, healthy in shown if healthy) + 0.2


def test_without_a_position_there_is_no_global_position(gcs: GroundStation) -> None:
    gcs.vehicle.faults.gps_lost = True
    gcs.fly(5.1)  # dead reckoning is over
    begin_s = gcs.now_s
    gcs.fly(2.0)
    assert gcs.messages("GLOBAL_POSITION_INT", begin_s) == []
    assert gcs.last("GPS_RAW_INT").fix_type == 0


@pytest.mark.parametrize(("rates", "hz"), [("onboard", 51.5), ("low", 10.0)])
def test_the_rates_are_what_is_said_of_them(rates: str, hz: float) -> None:
    """All messages of an idle vehicle a second, MISSION_CURRENT included."""
    gcs = GroundStation(rates=rates)
    begin_s = gcs.now_s
    gcs.fly(20.0)
    assert len([received for received in gcs.received if received.t_s >= begin_s]) / 20.0 == pytest.approx(hz, rel=0.03)
