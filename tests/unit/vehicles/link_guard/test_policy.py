"""Which frames pass on an open and on a pinned connection, and where ours go."""

from __future__ import annotations

from app.domain.vehicle.link_security import LinkSecurity, RefusalKind
from app.vehicles.link_guard.policy import (
    FRAMES_PER_S,
    PIN_S,
    PIN_SAME_ADDRESS_S,
    TEXTS_AT_ONCE,
    Peer,
)
from tests.support.link_policy import (
    FORGER,
    SAME_HOST,
    TO_ONE,
    VEHICLE,
    link,
)
from tests.support.mavlink_frames import MAV_TYPE_GCS, FrameSender

# pinned ------------------------------------------------------------------------------------------------------


def test_nothing_passes_before_a_heartbeat() -> None:
    one = link()
    assert one.takes(FrameSender().position()) is RefusalKind.NOT_ANNOUNCED
    assert one.takes(FrameSender().ping()) is RefusalKind.NOT_ANNOUNCED
    assert one.peers_of(TO_ONE.heartbeat()) == [], "nobody hears what we say"
    assert one.takes(FrameSender().heartbeat()) is None
    assert one.takes(FrameSender().position()) is None
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]


def test_the_first_peer_that_shows_a_heartbeat_is_the_only_one() -> None:
    one, forger = link(), FrameSender()
    one.takes(FrameSender().heartbeat())
    for frame in (forger.heartbeat(), forger.position(), forger.text("fake"), forger.ping(), forger.radio_status()):
        assert one.takes(frame, FORGER) is RefusalKind.OTHER_PEER
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]


def test_a_forger_that_is_louder_takes_nothing_over() -> None:
    one, vehicle, forger = link(), FrameSender(), FrameSender()
    one.takes(vehicle.heartbeat())
    for _ in range(120):
        assert one.takes(vehicle.heartbeat(), after_s=1.0) is None
        for _ in range(10):
            assert one.takes(forger.heartbeat(), FORGER) is RefusalKind.OTHER_PEER


def test_a_vehicle_that_restarts_on_another_port_is_taken_again_after_three_seconds() -> None:
    one, vehicle = link(), FrameSender()
    one.takes(vehicle.heartbeat())
    assert one.takes(vehicle.heartbeat(), SAME_HOST, after_s=PIN_SAME_ADDRESS_S - 0.1) is RefusalKind.OTHER_PEER
    assert one.takes(vehicle.position(), SAME_HOST, after_s=0.2) is RefusalKind.NOT_ANNOUNCED
    assert one.takes(vehicle.heartbeat(), SAME_HOST) is None
    assert one.peers_of(TO_ONE.heartbeat()) == [SAME_HOST]


def test_another_address_waits_for_thirty_seconds_of_silence() -> None:
    one, vehicle = link(), FrameSender()
    one.takes(vehicle.heartbeat())
    assert one.takes(vehicle.heartbeat(), FORGER, after_s=PIN_S - 0.1) is RefusalKind.OTHER_PEER
    assert one.takes(vehicle.heartbeat(), FORGER, after_s=0.2) is None


def test_a_connection_that_was_closed_frees_its_vehicle_for_the_same_address_at_once() -> None:
    one, vehicle = link(), FrameSender()
    one.takes(vehicle.heartbeat())
    one.policy.lost(VEHICLE)
    assert one.takes(vehicle.heartbeat(), FORGER) is RefusalKind.OTHER_PEER
    assert one.takes(vehicle.heartbeat(), SAME_HOST) is None


def test_vehicles_that_share_a_port_have_a_peer_each_and_hear_only_what_is_theirs() -> None:
    one = link()
    assert one.takes(FrameSender(1).heartbeat()) is None
    assert one.takes(FrameSender(2).heartbeat(), SAME_HOST) is None
    assert one.peers_of(TO_ONE.command(2, 400)) == [SAME_HOST]
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE, SAME_HOST]


def test_a_ground_station_is_noticed_where_the_vehicle_is_heard() -> None:
    one, station = link(), FrameSender(246, 190)
    one.takes(FrameSender().heartbeat())
    assert one.policy.ground_station_heard_s(1, 246) is None
    one.takes(station.heartbeat(kind=MAV_TYPE_GCS), FORGER)
    assert one.policy.ground_station_heard_s(1, 246) is None, "what comes from elsewhere does not count"
    one.takes(station.heartbeat(kind=MAV_TYPE_GCS), after_s=1.0)
    one.takes(station.ping(), after_s=1.0)
    assert one.policy.ground_station_heard_s(1, 246) == one.now_s - 1.0
    assert one.policy.ground_station_heard_s(2, 246) is None, "an unknown vehicle"


def test_another_ground_station_is_no_vehicle() -> None:
    one = link()
    assert one.takes(FrameSender(255, 190).heartbeat(kind=MAV_TYPE_GCS)) is RefusalKind.GROUND_STATION
    assert one.peers_of(TO_ONE.heartbeat()) == []


def test_a_damaged_heartbeat_pins_nobody() -> None:
    one, frame = link(), bytearray(FrameSender().heartbeat())
    frame[12] ^= 1
    assert one.takes(bytes(frame)) is RefusalKind.DAMAGED


def test_a_radio_speaks_for_itself_from_the_vehicles_address_alone() -> None:
    one, radio = link(), FrameSender(51, 68)
    assert one.takes(radio.radio_status()) is RefusalKind.NOT_ANNOUNCED
    one.takes(FrameSender().heartbeat())
    assert one.takes(radio.radio_status()) is None
    assert one.takes(radio.radio_status(), FORGER) is RefusalKind.NOT_ANNOUNCED


def test_so_many_systems_and_no_more_ever() -> None:
    one = link("?most_systems=3")
    verdicts = [one.takes(FrameSender(number).heartbeat(), after_s=PIN_S * 2) for number in range(1, 251)]
    assert verdicts[:3] == [None] * 3
    assert set(verdicts[3:]) == {RefusalKind.TOO_MANY_SYSTEMS}


def test_forged_system_ids_are_bounded_without_any_option() -> None:
    one = link()
    assert sum(one.takes(FrameSender(number).heartbeat(), FORGER) is None for number in range(1, 251)) == 32


def test_only_the_systems_that_are_named_are_taken() -> None:
    one = link("?system=1&system=7")
    assert one.takes(FrameSender(7).heartbeat()) is None
    assert one.takes(FrameSender(2).heartbeat()) is RefusalKind.SYSTEM_NOT_ALLOWED


def test_only_the_peers_that_are_named_are_taken() -> None:
    one = link("?peer=10.0.0.2")
    stranger = Peer("10.0.0.66", "10.0.0.66:5000", is_allowed=False)
    assert one.takes(FrameSender().heartbeat(), stranger) is RefusalKind.PEER_NOT_ALLOWED
    assert one.takes(FrameSender().heartbeat()) is None


def test_between_peers_that_are_named_three_seconds_of_silence_are_enough() -> None:
    one = link("?peer=10.0.0.0/24")
    one.takes(FrameSender().heartbeat())
    assert one.takes(FrameSender().heartbeat(), FORGER) is RefusalKind.OTHER_PEER
    assert one.takes(FrameSender().heartbeat(), FORGER, after_s=PIN_SAME_ADDRESS_S + 0.1) is None


# open --------------------------------------------------------------------------------------------------------


def test_on_an_open_connection_everybody_speaks_and_everybody_hears() -> None:
    one = link("?peer=any")
    one.takes(FrameSender().heartbeat())
    assert one.takes(FrameSender().position(), FORGER) is None
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE, FORGER]
    assert one.policy.security(1) is LinkSecurity.OPEN


def test_the_peers_of_an_open_connection_are_bounded_and_the_vehicle_stays() -> None:
    one = link("?peer=any")
    one.takes(FrameSender().heartbeat())
    for number in range(500):
        one.takes(FrameSender().position(), after_s=0.1)
        one.takes(FrameSender().position(), Peer("10.0.0.66", f"10.0.0.66:{number}", is_allowed=True))
    peers = one.peers_of(TO_ONE.heartbeat())
    assert len(peers) == 32
    assert VEHICLE in peers


# rates -------------------------------------------------------------------------------------------------------


def test_of_a_flood_of_texts_so_many_pass_and_everything_else_does() -> None:
    one, vehicle = link(), FrameSender()
    one.takes(vehicle.heartbeat())
    texts = [one.takes(vehicle.text("noise"), after_s=0.001) for _ in range(5000)]
    assert texts[: int(TEXTS_AT_ONCE)] == [None] * int(TEXTS_AT_ONCE)
    assert TEXTS_AT_ONCE + 45 <= texts.count(None) <= TEXTS_AT_ONCE + 55
    assert one.takes(vehicle.position()) is None
    assert one.takes(vehicle.text("later"), after_s=1.0) is None


def test_a_vehicle_passes_so_many_frames_a_second() -> None:
    one, vehicle = link(), FrameSender()
    one.takes(vehicle.heartbeat())
    verdicts = [one.takes(vehicle.position(), after_s=0.0001) for _ in range(5000)]
    assert verdicts.count(None) == FRAMES_PER_S - 1
    assert verdicts[-1] is RefusalKind.TOO_FAST
    assert one.takes(vehicle.position(), after_s=1.0) is None
