"""The mission protocol, case by case as recorded from PX4 main (scenarios 02, 03, 03b, 05)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.mission.item import Item
from app.simulator.mission.store import plan_of
from app.simulator.wire import MissionAck
from tests.unit.simulator.cockpit import GROUND, RELEASE, RETURN, Cockpit, Plan, Wire, takeoff, waypoint

TEN = [takeoff(15), *(waypoint(15 * i, 0, 15) for i in range(1, 6)), RELEASE, *(waypoint(9, 40, 15),) * 2, RETURN]
OTHER = (246, 191)


@pytest.fixture
def cockpit() -> Cockpit:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    return cockpit


def count(cockpit: Cockpit, number: int, mission_type: int = 0, source: tuple[int, int] = GROUND) -> None:
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 1, number, mission_type, 0), source)


def begin(cockpit: Cockpit, upto: int) -> None:
    """Answer the requests before `upto`, so that `upto` is the open one."""
    count(cockpit, len(TEN))
    for seq in range(upto):
        cockpit.send(cockpit.item(seq, TEN[seq]))


def go_on(cockpit: Cockpit, first: int) -> None:
    for seq in range(first, len(TEN)):
        cockpit.send(cockpit.item(seq, TEN[seq]))


def acks(cockpit: Cockpit) -> list[tuple[int, int]]:
    """Receiver and result of every MISSION_ACK."""
    return [(ack.target_system, ack.type) for ack in cockpit.messages("MISSION_ACK")]


def requests(cockpit: Cockpit) -> list[int]:
    return [message.seq for message in cockpit.messages("MISSION_REQUEST_INT")]


def test_the_mission_id_is_the_one_px4_computes() -> None:
    """The five items of scenario 06 and the id that PX4 gave them."""
    nan = math.nan
    items = [
        Item(22, 6, 1, 0, 0, 0, nan, 473977428, 85455944, 15),
        Item(16, 6, 1, 0, 0, 0, nan, 473982818, 85455944, 15),
        Item(211, 2, 1, 1, 0, 0, 0, 0, 0, 0),
        Item(16, 6, 1, 0, 0, 0, nan, 473982818, 85461916, 15),
        Item(20, 2, 1, 0, 0, 0, 0, 0, 0, 0),
    ]
    assert plan_of(items).plan_id == 3292353930


def test_an_upload_is_requested_item_by_item_and_acknowledged_with_its_id(cockpit: Cockpit) -> None:
    assert cockpit.upload(TEN) == MissionAck.ACCEPTED
    assert requests(cockpit) == list(range(10))
    assert cockpit.last("MISSION_ACK").opaque_id == cockpit.vehicle.store.mission.plan_id
    cockpit.fly(1.1)
    current = cockpit.last("MISSION_CURRENT")
    assert (current.total, current.mission_state, current.mission_mode) == (10, 2, 2)
    assert current.mission_id == cockpit.last("MISSION_ACK").opaque_id


def test_before_a_mission_is_known_the_total_is_65535(cockpit: Cockpit) -> None:
    current = cockpit.last("MISSION_CURRENT")
    assert (current.total, current.mission_state, current.mission_id) == (65535, 1, 0)


def test_the_same_items_give_the_same_id_and_others_another(cockpit: Cockpit) -> None:
    ids = []
    for plan in (TEN, TEN[:9], TEN):
        cockpit.upload(plan)
        ids.append(cockpit.last("MISSION_ACK").opaque_id)
    assert ids[0] == ids[2] != ids[1]


def test_a_download_gives_back_every_item_bit_for_bit(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert cockpit.last("MISSION_COUNT").opaque_id == cockpit.vehicle.store.mission.plan_id
    for seq in range(10):
        cockpit.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))
    cockpit.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0, 0))

    def content(message: Message) -> bytes:
        message.target_system = message.target_component = 0
        return bytes(message.pack(mavlink.MAVLink(None)))[10:-2]

    sent = [content(cockpit.item(seq, plan)) for seq, plan in enumerate(TEN)]
    assert [content(message) for message in cockpit.messages("MISSION_ITEM_INT")] == sent


def test_a_silent_client_is_asked_every_quarter_second_and_given_up_after_five(cockpit: Cockpit) -> None:
    begin(cockpit, 3)
    cockpit.fly(4.9)
    asked = requests(cockpit).count(3)
    assert 18 <= asked <= 20
    cockpit.fly(0.3)
    assert "Mission sync timeout" in cockpit.texts()
    assert acks(cockpit) == []
    cockpit.fly(1.0)
    assert requests(cockpit).count(3) <= 20
    cockpit.send(cockpit.item(3, TEN[3]))
    assert acks(cockpit) == [(245, MissionAck.ERROR)]
    assert "IGN MISSION_ITEM: No transfer" in cockpit.texts()


def test_a_wrong_or_repeated_item_is_ignored_and_the_right_one_asked_again(cockpit: Cockpit) -> None:
    begin(cockpit, 2)
    cockpit.send(cockpit.item(4, TEN[4]))
    cockpit.send(cockpit.item(1, TEN[1]))
    assert acks(cockpit) == []
    cockpit.fly(0.3)
    assert requests(cockpit)[-2:] == [2, 2]
    go_on(cockpit, 2)
    assert acks(cockpit) == [(245, MissionAck.ACCEPTED)]


def test_a_failed_upload_leaves_the_stored_mission_untouched(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    before = cockpit.vehicle.store.mission
    assert cockpit.upload([*TEN[:3], Plan(9999)]) == MissionAck.UNSUPPORTED
    begin(cockpit, 3)
    cockpit.fly(6.0)
    assert cockpit.vehicle.store.mission is before


def test_a_count_in_mid_upload_is_busy_and_the_upload_goes_on(cockpit: Cockpit) -> None:
    begin(cockpit, 3)
    count(cockpit, 10)
    assert acks(cockpit) == [(245, MissionAck.ERROR)]
    assert "WPM: REJ. CMD: Busy" in cockpit.texts()
    go_on(cockpit, 3)
    assert acks(cockpit)[-1] == (245, MissionAck.ACCEPTED)


def test_a_repeated_count_before_item_0_only_repeats_the_request_and_keeps_the_first_count(cockpit: Cockpit) -> None:
    count(cockpit, 10)
    count(cockpit, 4)
    assert requests(cockpit) == [0, 0]
    for seq in range(4):
        cockpit.send(cockpit.item(seq, TEN[seq]))
    assert requests(cockpit)[-1] == 4
    assert acks(cockpit) == []


def test_a_second_client_is_refused_while_the_first_goes_on(cockpit: Cockpit) -> None:
    begin(cockpit, 3)
    count(cockpit, 4, source=OTHER)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0), OTHER)
    cockpit.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0), OTHER)
    cockpit.send(cockpit.item(3, TEN[9]), OTHER)
    assert acks(cockpit) == [(246, MissionAck.ERROR)]
    assert {"Mission download request ignored, already active", "WPM: IGN CLEAR CMD: Busy"} <= set(cockpit.texts())
    go_on(cockpit, 3)
    assert acks(cockpit)[-1] == (245, MissionAck.ACCEPTED)


def test_a_second_client_on_another_link_is_refused_there(cockpit: Cockpit) -> None:
    other_wire = Wire(cockpit)
    cockpit.vehicle.radio.channels.append(other_wire)
    begin(cockpit, 3)
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 1, 4, 0, 0), OTHER, other_wire)
    assert acks(cockpit) == [(246, MissionAck.ERROR)]


def test_cancelling_with_ack_15_works_at_once_and_without_an_answer(cockpit: Cockpit) -> None:
    begin(cockpit, 3)
    cockpit.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, 0, 0))
    cockpit.fly(0.06)
    assert acks(cockpit) == []
    assert cockpit.upload(TEN) == MissionAck.ACCEPTED


def test_the_last_item_again_is_acknowledged_again(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(cockpit.item(9, TEN[9]))
    assert acks(cockpit) == [(245, 0), (245, 0)]


def test_a_legacy_request_makes_the_next_upload_start_with_a_legacy_request(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    cockpit.send(mavlink.MAVLink_mission_request_message(1, 1, 0, 0))
    cockpit.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0, 0))
    count(cockpit, 10)
    cockpit.send(cockpit.item(0, TEN[0]))
    assert [message.seq for message in cockpit.messages("MISSION_REQUEST")] == [0]
    assert requests(cockpit)[-1] == 1
