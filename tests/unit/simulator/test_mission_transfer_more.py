"""The mission protocol, case by case as recorded from PX4 main (scenarios 02, 03, 03b, 05)."""

from __future__ import annotations

import math

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, MissionAck
from tests.unit.simulator.cockpit import GROUND, RELEASE, RETURN, Cockpit, Plan, do, takeoff, waypoint

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
