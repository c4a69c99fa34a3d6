"""Uploads, clears and set-current, case by case as recorded from PX4 main (scenarios 02, 03, 03b)."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, MissionAck
from tests.support.mission_steps import OTHER, TEN, acks, begin, count, go_on, requests
from tests.support.simulated_vehicle import RETURN, GroundStation, Plan, Wire, takeoff


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


def test_an_upload_is_requested_item_by_item_and_acknowledged_with_its_id(gcs: GroundStation) -> None:
    assert gcs.upload(TEN) == MissionAck.ACCEPTED
    assert requests(gcs) == list(range(10))
    assert gcs.last("MISSION_ACK").opaque_id == gcs.vehicle.store.mission.plan_id
    gcs.fly(1.1)
    current = gcs.last("MISSION_CURRENT")
    assert (current.total, current.mission_state, current.mission_mode) == (10, 2, 2)
    assert current.mission_id == gcs.last("MISSION_ACK").opaque_id


def test_before_a_mission_is_known_the_total_is_65535(gcs: GroundStation) -> None:
    current = gcs.last("MISSION_CURRENT")
    assert (current.total, current.mission_state, current.mission_id) == (65535, 1, 0)


def test_the_same_items_give_the_same_id_and_others_another(gcs: GroundStation) -> None:
    ids = []
    for plan in (TEN, TEN[:9], TEN):
        gcs.upload(plan)
        ids.append(gcs.last("MISSION_ACK").opaque_id)
    assert ids[0] == ids[2] != ids[1]


def test_a_silent_client_is_asked_every_quarter_second_and_given_up_after_five(gcs: GroundStation) -> None:
    begin(gcs, 3)
    gcs.fly(4.9)
    asked = requests(gcs).count(3)
    assert 18 <= asked <= 20
    gcs.fly(0.3)
    assert "Mission sync timeout" in gcs.texts()
    assert acks(gcs) == []
    gcs.fly(1.0)
    assert requests(gcs).count(3) <= 20
    gcs.send(gcs.item(3, TEN[3]))
    assert acks(gcs) == [(245, MissionAck.ERROR)]
    assert "IGN MISSION_ITEM: No transfer" in gcs.texts()


def test_a_wrong_or_repeated_item_is_ignored_and_the_right_one_asked_again(gcs: GroundStation) -> None:
    begin(gcs, 2)
    gcs.send(gcs.item(4, TEN[4]))
    gcs.send(gcs.item(1, TEN[1]))
    assert acks(gcs) == []
    gcs.fly(0.3)
    assert requests(gcs)[-2:] == [2, 2]
    go_on(gcs, 2)
    assert acks(gcs) == [(245, MissionAck.ACCEPTED)]


def test_a_failed_upload_leaves_the_stored_mission_untouched(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    before = gcs.vehicle.store.mission
    assert gcs.upload([*TEN[:3], Plan(9999)]) == MissionAck.UNSUPPORTED
    begin(gcs, 3)
    gcs.fly(6.0)
    assert gcs.vehicle.store.mission is before


def test_a_count_in_mid_upload_is_busy_and_the_upload_goes_on(gcs: GroundStation) -> None:
    begin(gcs, 3)
    count(gcs, 10)
    assert acks(gcs) == [(245, MissionAck.ERROR)]
    assert "WPM: REJ. CMD: Busy" in gcs.texts()
    go_on(gcs, 3)
    assert acks(gcs)[-1] == (245, MissionAck.ACCEPTED)


def test_a_repeated_count_before_item_0_only_repeats_the_request_and_keeps_the_first_count(gcs: GroundStation) -> None:
    count(gcs, 10)
    count(gcs, 4)
    assert requests(gcs) == [0, 0]
    for seq in range(4):
        gcs.send(gcs.item(seq, TEN[seq]))
    assert requests(gcs)[-1] == 4
    assert acks(gcs) == []


def test_a_second_client_is_refused_while_the_first_goes_on(gcs: GroundStation) -> None:
    begin(gcs, 3)
    count(gcs, 4, source=OTHER)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0), OTHER)
    gcs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0), OTHER)
    gcs.send(gcs.item(3, TEN[9]), OTHER)
    assert acks(gcs) == [(246, MissionAck.ERROR)]
    assert {"Mission download request ignored, already active", "WPM: IGN CLEAR CMD: Busy"} <= set(gcs.texts())
    go_on(gcs, 3)
    assert acks(gcs)[-1] == (245, MissionAck.ACCEPTED)


def test_a_second_client_on_another_link_is_refused_there(gcs: GroundStation) -> None:
    other_wire = Wire(gcs)
    gcs.vehicle.radio.channels.append(other_wire)
    begin(gcs, 3)
    gcs.send(mavlink.MAVLink_mission_count_message(1, 1, 4, 0, 0), OTHER, other_wire)
    assert acks(gcs) == [(246, MissionAck.ERROR)]


def test_cancelling_with_ack_15_works_at_once_and_without_an_answer(gcs: GroundStation) -> None:
    begin(gcs, 3)
    gcs.send(mavlink.MAVLink_mission_ack_message(1, 1, 15, 0, 0))
    gcs.fly(0.06)
    assert acks(gcs) == []
    assert gcs.upload(TEN) == MissionAck.ACCEPTED


def test_the_last_item_again_is_acknowledged_again(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(gcs.item(9, TEN[9]))
    assert acks(gcs) == [(245, 0), (245, 0)]


@pytest.mark.parametrize(
    ("number", "answers"), [(10_000, []), (10_001, [MissionAck.NO_SPACE]), (65_535, [MissionAck.NO_SPACE])]
)
def test_ten_thousand_items_are_the_limit(gcs: GroundStation, number: int, answers: list[int]) -> None:
    count(gcs, number)
    assert [ack for _, ack in acks(gcs)] == answers


@pytest.mark.parametrize("mission_type", [3, 255])
def test_an_unknown_mission_type_has_no_space(gcs: GroundStation, mission_type: int) -> None:
    count(gcs, 2, mission_type)
    assert acks(gcs) == [(245, MissionAck.NO_SPACE)]


@pytest.mark.parametrize("how", ["clear", "zero items"])
def test_clearing_and_an_upload_of_nothing_are_the_same(gcs: GroundStation, how: str) -> None:
    gcs.upload(TEN)
    if how == "clear":
        gcs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    else:
        count(gcs, 0)
    assert acks(gcs)[-1] == (245, MissionAck.ACCEPTED)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").total == 65535


def test_messages_for_another_component_get_no_answer(gcs: GroundStation) -> None:
    gcs.send(mavlink.MAVLink_mission_count_message(1, 100, 2, 0, 0))
    gcs.send(mavlink.MAVLink_mission_count_message(9, 1, 2, 0, 0))
    assert requests(gcs) == []
    gcs.send(mavlink.MAVLink_mission_count_message(1, 0, 2, 0, 0))
    assert requests(gcs) == [0]


def test_set_current_has_no_ack_and_shows_within_a_second(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 4
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 77))
    assert gcs.texts()[-1] == "WPM: WP CURR CMD: Not in list"


def test_command_224_is_acknowledged_but_does_not_show_outside_mission_mode(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    assert gcs.command(Cmd.DO_SET_MISSION_CURRENT, 2) == [0]
    assert gcs.command(Cmd.DO_SET_MISSION_CURRENT, 77) == [4]
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 0


def test_a_lost_final_ack_is_sent_for_nobody_and_the_mission_is_stored() -> None:
    gcs = GroundStation()
    gcs.vehicle.faults.lost_acks = 1
    with pytest.raises(AssertionError, match="stopped asking"):
        gcs.upload([takeoff(10), RETURN])
    assert len(gcs.vehicle.store.mission) == 2
    gcs.vehicle.faults.lost_acks = 1
    assert gcs.command(Cmd.COMPONENT_ARM_DISARM, 1) == []
    assert gcs.armed


def test_a_refused_upload_says_what_it_was_told_to_say() -> None:
    gcs = GroundStation()
    gcs.vehicle.faults.refuse_upload = 14
    assert gcs.upload([takeoff(10), RETURN]) == 14
