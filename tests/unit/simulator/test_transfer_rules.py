"""Rules of the mission protocol beyond the plain upload and download: partners, types, indices, what is kept."""

from __future__ import annotations

import pytest

from app.simulator.dialect import mavlink
from app.simulator.wire import Cmd, MissionAck
from tests.support.mission_steps import OTHER, TEN, acks, begin, count, go_on, requests
from tests.support.simulated_vehicle import GroundStation, Plan, takeoff, waypoint

MISSION, FENCE, RALLY, ALL = 0, 1, 2, 255
SQUARE = [Plan(5001, n, e, 0, (4, 0, 0, 0)) for n, e in ((-50, -50), (50, -50), (50, 50), (-50, 50))]
RALLY_POINT = Plan(5100, 30, 30, 20, (0, 0, 0, 0))


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


def ask(gcs: GroundStation, seq: int) -> None:
    gcs.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))


def ground_ack(gcs: GroundStation, result: int, source: tuple[int, int] = (245, 190)) -> None:
    gcs.send(mavlink.MAVLink_mission_ack_message(1, 1, result, 0, 0), source)


# uploads ----------------------------------------------------------------------------------------------------


def test_an_item_of_somebody_else_is_ignored_even_when_its_index_is_wanted(gcs: GroundStation) -> None:
    begin(gcs, 3)
    gcs.send(gcs.item(3, waypoint(77, 77, 77)), OTHER)
    assert requests(gcs)[-1] == 3
    go_on(gcs, 3)
    assert [item.z for item in gcs.vehicle.store.mission.items[1:6]] == [15.0] * 5


def test_a_refused_item_ends_the_transfer_and_the_next_may_begin(gcs: GroundStation) -> None:
    begin(gcs, 3)
    gcs.send(gcs.item(3, Plan(9999)))
    mark = len(requests(gcs))
    gcs.fly(1.0)
    assert len(requests(gcs)) == mark, "it asks for nothing more"
    assert gcs.upload(TEN) == MissionAck.ACCEPTED


def test_any_other_ack_than_cancelled_stops_no_upload(gcs: GroundStation) -> None:
    begin(gcs, 3)
    ground_ack(gcs, 0)
    ground_ack(gcs, 15, source=OTHER)
    go_on(gcs, 3)
    assert acks(gcs) == [(245, MissionAck.ACCEPTED)]


def test_the_item_marked_current_is_the_one_to_start_with(gcs: GroundStation) -> None:
    count(gcs, 3)
    for seq, current in ((0, 0), (1, 0), (2, 1)):
        item = gcs.item(seq, waypoint(10 * seq, 0, 10))
        item.current = current
        gcs.send(item)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 2


def test_a_new_mission_starts_at_item_0_whatever_was_current_before(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    gcs.upload(TEN)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 0


def test_set_current_is_refused_during_a_transfer(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    begin(gcs, 3)
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 4))
    assert gcs.texts()[-1] == "WPM: IGN WP CURR CMD: Busy"
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 0


def test_there_are_two_slots_and_an_upload_goes_to_the_one_not_flown(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    store = gcs.vehicle.store
    flown, first = store.active_slot, store.mission
    begin(gcs, 9)
    assert (store.active_slot, store.mission) == (flown, first), "until its last item"
    go_on(gcs, 9)
    assert store.active_slot == 1 - flown
    assert store.slots[flown] is first


def test_a_reboot_forgets_an_open_transfer(gcs: GroundStation) -> None:
    begin(gcs, 3)
    gcs.command(Cmd.PREFLIGHT_REBOOT_SHUTDOWN, 1)
    mark = len(requests(gcs))
    gcs.fly(3.0)
    assert len(requests(gcs)) == mark
    gcs.send(gcs.item(3, TEN[3]))
    assert acks(gcs)[-1] == (245, MissionAck.ERROR)


def test_a_client_that_uses_the_int_messages_is_asked_by_them_again(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    gcs.send(mavlink.MAVLink_mission_request_message(1, 1, 0, 0))
    ground_ack(gcs, 0)
    begin(gcs, 2)
    assert requests(gcs)[-2:] == [1, 2]


# limits and types -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mission_type", "number", "refused"),
    [(FENCE, 64, False), (FENCE, 65, True), (RALLY, 32, False), (RALLY, 33, True)],
)
def test_fence_and_rally_points_have_limits_of_their_own(
    gcs: GroundStation, mission_type: int, number: int, refused: bool
) -> None:
    count(gcs, number, mission_type)
    assert acks(gcs) == ([(245, MissionAck.NO_SPACE)] if refused else [])


@pytest.mark.parametrize(
    ("cleared", "left"), [(MISSION, (0, 4, 1)), (FENCE, (10, 0, 1)), (RALLY, (10, 4, 0)), (ALL, (0, 0, 0))]
)
def test_a_clear_empties_what_it_names(gcs: GroundStation, cleared: int, left: tuple[int, int, int]) -> None:
    for plan, mission_type in ((SQUARE, FENCE), ([RALLY_POINT], RALLY), (TEN, MISSION)):
        assert gcs.upload(plan, mission_type) == 0
    gcs.send(mavlink.MAVLink_mission_clear_all_message(1, 1, cleared))
    store = gcs.vehicle.store
    assert (len(store.mission), len(store.fence), len(store.rally)) == left


@pytest.mark.parametrize(("mission_type", "command"), [(FENCE, 5100), (FENCE, 22), (RALLY, 5001), (RALLY, 22)])
def test_fence_and_rally_plans_take_their_own_items_alone(gcs: GroundStation, mission_type: int, command: int) -> None:
    assert gcs.upload([Plan(command, 10, 0, 10)], mission_type) == MissionAck.UNSUPPORTED


@pytest.mark.parametrize("mission_type", [FENCE, RALLY])
def test_but_a_waypoint_passes_in_both(gcs: GroundStation, mission_type: int) -> None:
    """Scenario 05."""
    assert gcs.upload([waypoint(10, 0, 10)], mission_type) == MissionAck.ACCEPTED


# downloads --------------------------------------------------------------------------------------------------


def test_the_item_before_may_be_asked_for_again(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    for seq in (0, 1, 1, 2):
        ask(gcs, seq)
    assert [item.seq for item in gcs.messages("MISSION_ITEM_INT")] == [0, 1, 1, 2]


def test_a_download_shows_which_item_is_current(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    for seq in range(4):
        ask(gcs, seq)
    assert [item.current for item in gcs.messages("MISSION_ITEM_INT")] == [0, 0, 1, 0]


def test_a_downloader_is_given_up_after_five_seconds(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    gcs.fly(5.2)
    assert gcs.texts()[-1] == "Mission sync timeout"
    assert gcs.upload([takeoff(10)]) == MissionAck.ACCEPTED


def test_more_items_than_the_route_cache_holds_are_said_and_taken() -> None:
    """Scenario 04."""
    gcs = GroundStation()
    assert gcs.upload([takeoff(10), *(waypoint(15, 0, 10),) * 500]) == MissionAck.ACCEPTED
    gcs.fly(1.1)
    assert "".join(gcs.texts()) == "Mission with 501 items exceeds route cache capacity 500"
    assert gcs.last("MISSION_CURRENT").mission_state == 2
