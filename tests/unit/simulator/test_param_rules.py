"""The PARAM protocol's rules beyond reading and setting one."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import pytest

from app.simulator.dialect import Message, mavlink
from tests.support.simulated_vehicle import RETURN, GroundStation, takeoff

READ, SET, LIST = "read", "set", "list"
UNREAD = 65535


def as_float(value: int) -> float:
    return float(struct.unpack("<f", struct.pack("<i", value))[0])


def bits(message: Message) -> bytes:
    return struct.pack("<f", message.param_value)


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


def send(gcs: GroundStation, what: str, system: int = 1, component: int = 1) -> None:
    target = (system, component)
    messages = {
        READ: mavlink.MAVLink_param_request_read_message(*target, b"NAV_ACC_RAD", -1),
        SET: mavlink.MAVLink_param_set_message(*target, b"NAV_ACC_RAD", 3.0, 9),
        LIST: mavlink.MAVLink_param_request_list_message(*target),
    }
    gcs.send(messages[what])
    gcs.fly(0.1)


@pytest.mark.parametrize("what", [READ, SET, LIST])
@pytest.mark.parametrize(
    ("system", "component", "received"), [(1, 1, True), (1, 0, True), (0, 0, True), (2, 1, False), (1, 169, False)]
)
def test_it_answers_what_is_for_the_autopilot(
    gcs: GroundStation, what: str, system: int, component: int, received: bool
) -> None:
    send(gcs, what, system, component)
    assert bool(gcs.messages("PARAM_VALUE", since_s=3.0)) is received


@pytest.mark.parametrize("index", [9999, 32767])
def test_an_index_beyond_the_last_is_an_error(gcs: GroundStation, index: int) -> None:
    gcs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
    assert gcs.last("PARAM_ERROR").error == 1
    assert gcs.messages("PARAM_VALUE", since_s=3.0) == []


@dataclass
class Ear:
    """A second link of the vehicle; `values` are the PARAM_VALUEs on it."""

    gcs_heard_s: float | None = None
    values: list[tuple[str, float, int]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        self.names.append(message.get_type())
        if message.get_type() == "PARAM_VALUE":
            self.values.append((message.param_id, message.param_value, message.param_index))


@pytest.fixture
def other(gcs: GroundStation) -> Ear:
    ear = Ear()
    gcs.vehicle.radio.channels.append(ear)
    return ear


def change(gcs: GroundStation, name: str, value: float, kind: int = 9) -> list[Message]:
    """PARAM_SET on the ground station's link; the PARAM_VALUEs that come on it within 0.1 s."""
    mark = len(gcs.received)
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    gcs.fly(0.1)
    return [received.message for received in gcs.received[mark:] if received.name == "PARAM_VALUE"]


def checksum(gcs: GroundStation) -> Message:
    mark = len(gcs.received)
    gcs.send(mavlink.MAVLink_param_request_read_message(1, 1, b"_HASH_CHECK", -1))
    return next(received.message for received in gcs.received[mark:] if received.name == "PARAM_VALUE")


def test_an_answer_goes_to_the_asking_link_alone(gcs: GroundStation, other: Ear) -> None:
    send(gcs, READ)
    send(gcs, LIST)
    gcs.fly(1.0)
    assert len(gcs.messages("PARAM_VALUE")) > 50
    assert other.values == []


def test_a_change_is_answered_and_told_to_every_link(gcs: GroundStation, other: Ear) -> None:
    """Recording 28."""
    index = gcs.vehicle.params.index_of("NAV_ACC_RAD")
    told = [(value.param_id, value.param_value, value.param_index) for value in change(gcs, "NAV_ACC_RAD", 3.0)]
    assert told == [("NAV_ACC_RAD", 3.0, index)] * 2
    assert other.values == [("NAV_ACC_RAD", 3.0, index)]


def test_the_same_value_again_is_answered_alone(gcs: GroundStation, other: Ear) -> None:
    change(gcs, "NAV_ACC_RAD", 3.0)
    gcs.fly(3.0)
    other.values.clear()
    assert len(change(gcs, "NAV_ACC_RAD", 3.0)) == 1
    assert other.values == []


def test_changes_in_a_burst_are_announced_once_each(gcs: GroundStation, other: Ear) -> None:
    for value in (3.0, 4.0):
        gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"NAV_ACC_RAD", value, 9))
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"PD_GRIPPER_TO", 2.0, 9))
    gcs.fly(0.1)
    assert [(name, value) for name, value, _index in other.values] == [("NAV_ACC_RAD", 4.0), ("PD_GRIPPER_TO", 2.0)]


def test_what_px4_has_not_read_yet_is_answered_without_an_index_and_not_announced(
    gcs: GroundStation, other: Ear
) -> None:
    """Recording 28: MIS_TKO_LAND_REQ until the first mission check after the boot."""
    told = change(gcs, "MIS_TKO_LAND_REQ", as_float(1), 6)
    assert [value.param_index for value in told] == [UNREAD]
    assert other.values == []
    count = told[0].param_count
    assert gcs.upload([takeoff(15), RETURN]) == 0
    gcs.fly(1.0)
    told = change(gcs, "MIS_TKO_LAND_REQ", as_float(0), 6)
    index = gcs.vehicle.params.index_of("MIS_TKO_LAND_REQ")
    assert [value.param_index for value in told] == [index] * 2
    assert [(name, at) for name, _value, at in other.values] == [("MIS_TKO_LAND_REQ", index)]
    assert told[0].param_count == count + 3
    gcs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    gcs.vehicle.reboot()
    gcs.fly(2.0)
    assert gcs.vehicle.params.index_of("MIS_TKO_LAND_REQ") == UNREAD


def test_the_hash_changes_with_what_px4_has_read(gcs: GroundStation) -> None:
    """Recording 28b."""
    before = checksum(gcs)
    assert (before.param_type, before.param_index) == (5, UNREAD)
    change(gcs, "MIS_TKO_LAND_REQ", as_float(1), 6)
    assert bits(checksum(gcs)) == bits(before)
    change(gcs, "NAV_ACC_RAD", 3.0)
    assert bits(checksum(gcs)) != bits(before)
    change(gcs, "NAV_ACC_RAD", 10.0)
    assert bits(checksum(gcs)) == bits(before)
    gcs.upload([takeoff(15), RETURN])
    gcs.fly(1.0)
    read = checksum(gcs)
    assert bits(read) != bits(before)
    change(gcs, "MIS_TKO_LAND_REQ", as_float(0), 6)
    assert bits(checksum(gcs)) != bits(read)


def test_the_hash_cannot_be_set_and_ends_a_list(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_param_request_list_message(1, 1))
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 0.0, 6))
    gcs.fly(1.0)
    assert gcs.last("PARAM_ERROR").error == 5
    assert gcs.messages("PARAM_VALUE", since_s=3.0) == []


def test_what_is_not_saved_yet_comes_unasked_at_the_boot_and_not_after_the_next(gcs: GroundStation) -> None:
    told = {value.param_id for value in gcs.messages("PARAM_VALUE")}
    assert {"SYS_AUTOSTART", "MAV_SYS_ID", "PWM_MAIN_FUNC5"} <= told
    assert len(told) < 10
    gcs.vehicle.reboot()
    mark_s = gcs.now_s
    gcs.fly(3.0)
    assert gcs.messages("PARAM_VALUE", since_s=mark_s) == []


def test_a_second_list_request_begins_the_list_again_without_the_hash(gcs: GroundStation) -> None:
    send(gcs, LIST)
    send(gcs, LIST)
    gcs.fly(1.0)
    values = gcs.messages("PARAM_VALUE", since_s=3.0)
    indices = [value.param_index for value in values]
    count = values[-1].param_count
    assert indices[-count:] == list(range(count))
    assert count < len(indices) < 2 * count
    assert [value.param_id for value in values].count("_HASH_CHECK") == 1


def test_out_of_range_values_are_taken(gcs: GroundStation) -> None:
    """Scenario 01: COM_OBL_RC_ACT=99."""
    gcs.send(mavlink.MAVLink_param_set_message(1, 1, b"NAV_ACC_RAD", -1e30, 9))
    assert gcs.vehicle.params["NAV_ACC_RAD"] == pytest.approx(-1e30)
