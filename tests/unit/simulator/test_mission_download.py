"""Downloads, case by case as recorded from PX4 main (scenarios 02, 03b)."""

from __future__ import annotations

import pytest

from app.simulator.dialect import Message, mavlink
from app.simulator.wire import MissionAck
from tests.support.mission_steps import TEN, acks, count, requests
from tests.support.simulated_vehicle import GroundStation


@pytest.fixture
def gcs() -> GroundStation:
    gcs = GroundStation(ready=False)
    gcs.fly(3.0)
    return gcs


def test_a_download_gives_back_every_item_bit_for_bit(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    assert gcs.last("MISSION_COUNT").opaque_id == gcs.vehicle.store.mission.plan_id
    for seq in range(10):
        gcs.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, 0))
    gcs.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0, 0))

    def content(message: Message) -> bytes:
        message.target_system = message.target_component = 0
        return bytes(message.pack(mavlink.MAVLink(None)))[10:-2]

    sent = [content(gcs.item(seq, plan)) for seq, plan in enumerate(TEN)]
    assert [content(message) for message in gcs.messages("MISSION_ITEM_INT")] == sent


def test_a_legacy_request_makes_the_next_upload_start_with_a_legacy_request(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    gcs.send(mavlink.MAVLink_mission_request_message(1, 1, 0, 0))
    gcs.send(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0, 0))
    count(gcs, 10)
    gcs.send(gcs.item(0, TEN[0]))
    assert [message.seq for message in gcs.messages("MISSION_REQUEST")] == [0]
    assert requests(gcs)[-1] == 1


def test_an_item_request_without_a_list_request_is_ignored(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    received = len(gcs.received)
    gcs.send(mavlink.MAVLink_mission_request_int_message(1, 1, 3, 0))
    assert len(gcs.received) == received, "neither an item nor an ack"


def test_an_unexpected_index_ends_a_download(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    gcs.send(mavlink.MAVLink_mission_request_int_message(1, 1, 2, 0))
    assert acks(gcs)[-1] == (245, MissionAck.ERROR)
    assert "WPM: REJ. CMD: Req. WP was unexpected" in gcs.texts()


def test_a_silent_downloader_hears_the_count_again_and_again(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    gcs.fly(6.0)
    assert 18 <= len(gcs.messages("MISSION_COUNT")) <= 20


def test_a_count_during_a_download_is_refused(gcs: GroundStation) -> None:
    gcs.upload(TEN)
    gcs.send(mavlink.MAVLink_mission_request_list_message(1, 1, 0))
    count(gcs, 10)
    assert acks(gcs)[-1] == (245, MissionAck.ERROR)
    assert "WPM: IGN MISSION_COUNT: Busy" in gcs.texts()
