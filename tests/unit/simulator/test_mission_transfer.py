"""The mission protocol, case by case as recorded from PX4 main (scenarios 02, 03, 03b, 05)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.mission.item import Item
from app.simulator.mission.store import plan_of
from app.simulator.wire import Cmd, MissionAck
from tests.unit.simulator.cockpit import GROUND, RELEASE, RETURN, Cockpit, Plan, Wire, do, takeoff, waypoint

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


def test_float_items_are_taken(cockpit: Cockpit) -> None:
    count(cockpit, 1)
    cockpit.send(
        mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 22, 0, 1, 0, 0, 0, math.nan, 47.39775, 8.54559, 15, 0)
    )
    assert acks(cockpit) == [(245, MissionAck.ACCEPTED)]
    assert cockpit.vehicle.store.mission.items[0].latitude_deg == pytest.approx(47.39775, abs=1e-5)


def test_an_item_request_without_a_list_request_is_ignored(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_int_message(1, 1, 3, 0))
    assert cockpit.messages("MISSION_ITEM_INT") == []


def test_an_unexpected_index_ends_a_download(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    cockpit.send(mavlink.MAVLink_mission_request_int_message(1, 1, 2, 0))
    assert acks(cockpit)[-1] == (245, MissionAck.ERROR)
    assert "WPM: REJ. CMD: Req. WP was unexpected" in cockpit.texts()


def test_a_silent_downloader_hears_the_count_again_and_again(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    cockpit.fly(6.0)
    assert 18 <= len(cockpit.messages("MISSION_COUNT")) <= 20


def test_a_count_during_a_download_is_refused(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    count(cockpit, 10)
    assert acks(cockpit)[-1] == (245, MissionAck.ERROR)
    assert "WPM: IGN MISSION_COUNT: Busy" in cockpit.texts()


@pytest.mark.parametrize(
    ("number", "answers"), [(10_000, []), (10_001, [MissionAck.NO_SPACE]), (65_535, [MissionAck.NO_SPACE])]
)
def test_ten_thousand_items_are_the_limit(cockpit: Cockpit, number: int, answers: list[int]) -> None:
    count(cockpit, number)
    assert [ack for _, ack in acks(cockpit)] == answers


@pytest.mark.parametrize("mission_type", [3, 255])
def test_an_unknown_mission_type_has_no_space(cockpit: Cockpit, mission_type: int) -> None:
    count(cockpit, 2, mission_type)
    assert acks(cockpit) == [(245, MissionAck.NO_SPACE)]


@pytest.mark.parametrize("how", ["clear", "zero items"])
def test_clearing_and_an_upload_of_nothing_are_the_same(cockpit: Cockpit, how: str) -> None:
    cockpit.upload(TEN)
    if how == "clear":
        cockpit.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    else:
        count(cockpit, 0)
    assert acks(cockpit)[-1] == (245, MissionAck.ACCEPTED)
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").total == 65535


def test_messages_for_another_component_get_no_answer(cockpit: Cockpit) -> None:
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 100, 2, 0, 0))
    cockpit.send(mavlink.MAVLink_mission_count_message(9, 1, 2, 0, 0))
    assert requests(cockpit) == []
    cockpit.send(mavlink.MAVLink_mission_count_message(1, 0, 2, 0, 0))
    assert requests(cockpit) == [0]


def test_set_current_has_no_ack_and_shows_within_a_second(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    cockpit.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").seq == 4
    cockpit.send(mavlink.MAVLink_mission_set_current_message(1, 1, 77))
    assert cockpit.texts()[-1] == "WPM: WP CURR CMD: Not in list"


def test_command_224_is_acknowledged_but_does_not_show_outside_mission_mode(cockpit: Cockpit) -> None:
    cockpit.upload(TEN)
    assert cockpit.command(Cmd.DO_SET_MISSION_CURRENT, 2) == [0]
    assert cockpit.command(Cmd.DO_SET_MISSION_CURRENT, 77) == [4]
    cockpit.fly(1.1)
    assert cockpit.last("MISSION_CURRENT").seq == 0


def test_fence_and_rally_have_ids_of_their_own_and_a_fence_forgets_frame_and_autocontinue(cockpit: Cockpit) -> None:
    square = [Plan(5001, n, e, 0, (4, 0, 0, 0)) for n, e in ((-50, -50), (50, -50), (50, 50), (-50, 50))]
    assert cockpit.upload(square, 1) == MissionAck.ACCEPTED
    assert cockpit.upload([Plan(5100, 30, 30, 20, (0, 0, 0, 0))], 2) == MissionAck.ACCEPTED
    cockpit.fly(1.1)
    current = cockpit.last("MISSION_CURRENT")
    assert 0 not in (current.fence_id, current.rally_points_id)
    assert current.mission_id == 0
    cockpit.send(mavlink.MAVLink_mission_request_list_message(1, 1, 1))
    cockpit.send(mavlink.MAVLink_mission_request_int_message(1, 1, 0, 1))
    item = cockpit.last("MISSION_ITEM_INT")
    assert (item.command, item.frame, item.autocontinue, item.param1) == (5001, 5, 0, 4)


def test_a_polygon_of_two_vertices_is_an_error(cockpit: Cockpit) -> None:
    assert cockpit.upload([Plan(5001, 0, 0, 0, (2, 0, 0, 0))] * 2, 1) == MissionAck.ERROR


@pytest.mark.parametrize(
    ("plan", "answer"),
    [
        (Plan(Cmd.DO_GRIPPER, params=(1, 0, 0, 0), frame=6), MissionAck.INVALID_PARAM5_X),
        (Plan(9999), MissionAck.UNSUPPORTED),
        (Plan(42), MissionAck.UNSUPPORTED),
        (Plan(82, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(94, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(18, 10, 0, 15), MissionAck.UNSUPPORTED),
        (Plan(16, 10, 0, 15, frame=8), MissionAck.UNSUPPORTED_FRAME),
        (Plan(16, 10, 0, 15, frame=1), MissionAck.UNSUPPORTED_FRAME),
        (Plan(16, 10, 0, 15, frame=10), MissionAck.UNSUPPORTED_FRAME),
        (Plan(5001, 10, 0, 0, (4, 0, 0, 0)), MissionAck.ERROR),
        (Plan(16, 10, 0, 15, (0, 0, 7, 0)), MissionAck.INVALID_PARAM1 + 2),
        (Plan(16, 10, 0, 15, frame=5), MissionAck.ACCEPTED),
        (Plan(16, 10, 0, math.nan), MissionAck.ACCEPTED),
        (do(Cmd.NAV_DELAY, 3), MissionAck.ACCEPTED),
        (do(Cmd.DO_WINCH, 1, 4, 5, 1), MissionAck.ACCEPTED),
        (do(Cmd.DO_GRIPPER, 7, 5), MissionAck.ACCEPTED),
    ],
)
def test_items_are_taken_or_refused_as_recorded(cockpit: Cockpit, plan: Plan, answer: int) -> None:
    if plan.command == Cmd.DO_GRIPPER and plan.frame == 6:  # with a position, as a client would wrongly give it
        plan = Plan(plan.command, 10.0, 0.0, 0.0, plan.params, frame=6)
    assert cockpit.upload([takeoff(15), plan]) == answer
    if answer not in (MissionAck.ACCEPTED, MissionAck.ERROR):
        assert cockpit.texts()[-1] == "IGN MISSION_ITEM: Invalid item"


def test_older_firmware_does_not_know_masks_nor_ids() -> None:
    cockpit = Cockpit(firmware="px4-1.14")
    assert cockpit.upload([takeoff(15), Plan(16, 10, 0, 15, (0, 0, 7, 0))]) == MissionAck.ACCEPTED
    assert cockpit.last("MISSION_ACK").opaque_id == 0
    cockpit.fly(1.1)
    current = cockpit.last("MISSION_CURRENT")
    assert (current.mission_id, current.mission_state) == (0, 0)
