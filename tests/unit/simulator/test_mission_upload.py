"""Uploads, clears and set-current, case by case as recorded from PX4 main (scenarios 02, 03, 03b)."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, MissionAck
from tests.support.mission_steps import OTHER, TEN, acks, begin, count, go_on, requests
from tests.support.simulated_vehicle import RETURN, Cockpit, Plan, Wire, takeoff


@pytest.fixture
def cockpit() -> Cockpit:
    cockpit = Cockpit(ready=False)
    cockpit.fly(3.0)
    return cockpit


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


def test_a_lost_final_ack_is_sent_for_nobody_and_the_mission_is_stored() -> None:
    cockpit = Cockpit()
    cockpit.vehicle.faults.lost_acks = 1
    with pytest.raises(AssertionError, match="stopped asking"):
        cockpit.upload([takeoff(10), RETURN])
    assert len(cockpit.vehicle.store.mission) == 2
    cockpit.vehicle.faults.lost_acks = 1
    assert cockpit.command(Cmd.COMPONENT_ARM_DISARM, 1) == []
    assert cockpit.armed


def test_a_refused_upload_says_what_it_was_told_to_say() -> None:
    cockpit = Cockpit()
    cockpit.vehicle.faults.refuse_upload = 14
    assert cockpit.upload([takeoff(10), RETURN]) == 14
