"""Which frames of a vehicle with a key pass, and where ours go, signed with what."""

from __future__ import annotations

import pytest

from app.domain.vehicle.link_security import LinkSecurity, RefusalKind
from app.vehicles.link_guard.keyring import StoredKey
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.policy import (
    FRAMES_PER_S,
    MOST_ANSWERED,
    MOST_RADIOS,
    PIN_S,
    SIGNED_PIN_S,
    LinkPolicy,
    Peer,
)
from app.vehicles.link_guard.signing import SigningKey
from tests.support.link_policy import (
    FORGER,
    IN_USE,
    NEW,
    OTHER_SECRET,
    SAME_HOST,
    SECRET,
    TO_ONE,
    VEHICLE,
    Link,
    link,
    signer,
)
from tests.support.mavlink_frames import FrameSender


def test_a_vehicle_with_a_key_in_use_is_heard_signed_alone() -> None:
    one = link(keys=IN_USE)
    assert one.takes(FrameSender().heartbeat()) is RefusalKind.UNSIGNED
    assert one.takes(signer(OTHER_SECRET).heartbeat()) is RefusalKind.BAD_SIGNATURE
    vehicle = signer()
    assert one.takes(vehicle.heartbeat()) is None
    assert one.takes(vehicle.position()) is None
    assert one.takes(FrameSender().position()) is RefusalKind.UNSIGNED
    assert one.policy.security(1) is LinkSecurity.SIGNED


def test_a_vehicle_whose_key_was_just_made_is_heard_unsigned_until_it_signs() -> None:
    one = link(keys=NEW)
    assert one.takes(FrameSender().heartbeat()) is None
    assert one.policy.security(1) is LinkSecurity.PINNED
    assert one.takes(signer().heartbeat()) is None
    assert one.policy.security(1) is LinkSecurity.SIGNED
    assert one.takes(FrameSender().heartbeat()) is RefusalKind.UNSIGNED


def test_that_it_signs_is_not_forgotten() -> None:
    one = link(keys=NEW, used={1: SigningKey(SECRET).fingerprint})
    assert one.takes(FrameSender().heartbeat()) is RefusalKind.UNSIGNED


def test_a_forger_that_came_first_loses_the_vehicle_to_its_signature() -> None:
    one = link(keys=NEW)
    assert one.takes(FrameSender().heartbeat(), FORGER) is None
    assert one.takes(signer().heartbeat()) is None
    assert one.takes(FrameSender().heartbeat(), FORGER) is RefusalKind.UNSIGNED
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]


def test_what_was_heard_once_is_refused_wherever_it_comes_from() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    frames = [vehicle.heartbeat(), vehicle.position()]
    assert [one.takes(frame) for frame in frames] == [None, None]
    for frame in frames:
        assert one.takes(frame) is RefusalKind.OLD_TIMESTAMP
        assert one.takes(frame, FORGER, after_s=PIN_S * 2) is RefusalKind.OLD_TIMESTAMP


def test_a_recording_of_an_earlier_day_is_refused_though_its_stream_was_never_heard() -> None:
    one = link(keys=IN_USE)
    assert one.takes(signer(ahead_s=-86_400.0).heartbeat()) is RefusalKind.OLD_TIMESTAMP


def test_what_the_vehicle_said_on_another_link_is_not_carried_over_to_this_one() -> None:
    one = link(keys=IN_USE)
    assert one.takes(signer(link_id=0).heartbeat()) is None
    assert one.takes(signer(link_id=1, ahead_s=5.0).position(), FORGER) is RefusalKind.OTHER_LINK_ID
    assert one.takes(signer(link_id=1, ahead_s=99.0).position(), after_s=PIN_S + 1.0) is None


def test_a_forger_that_carries_frames_faster_does_not_hear_our_commands() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    one.takes(vehicle.heartbeat())
    for _ in range(50):
        frame = vehicle.position()
        assert one.takes(frame, FORGER, after_s=0.1) is None, "it is the vehicle's word"
        assert one.takes(frame) is RefusalKind.OLD_TIMESTAMP
        assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]


def test_a_signed_vehicle_is_answered_at_its_new_address_after_a_second() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    one.takes(vehicle.heartbeat())
    assert one.takes(vehicle.position(), SAME_HOST) is None, "what it says counts at once"
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]
    assert one.takes(vehicle.position(), SAME_HOST, after_s=SIGNED_PIN_S + 0.1) is None
    assert one.peers_of(TO_ONE.heartbeat()) == [SAME_HOST]


def test_frames_to_a_signed_vehicle_are_signed_with_its_key() -> None:
    one = link(keys=IN_USE)
    one.takes(signer().heartbeat())
    one.takes(FrameSender(2).heartbeat(), SAME_HOST)
    routes = one.policy.routes(TO_ONE.heartbeat())
    assert [(route.peer, route.key and route.key.secret) for route in routes] == [(VEHICLE, SECRET), (SAME_HOST, None)]


def test_the_next_key_takes_over_when_the_vehicle_signs_with_it() -> None:
    keys = {1: [StoredKey(SigningKey(SECRET), in_use=True), StoredKey(SigningKey(OTHER_SECRET))]}
    one = link(keys=keys)
    one.takes(signer().heartbeat())
    assert one.takes(signer(OTHER_SECRET, ahead_s=1.0).heartbeat()) is None
    assert [route.key and route.key.secret for route in one.policy.routes(TO_ONE.heartbeat())] == [OTHER_SECRET]
    assert one.takes(signer(SECRET, ahead_s=2.0).heartbeat()) is RefusalKind.BAD_SIGNATURE


def test_only_radio_status_passes_unsigned_and_only_from_the_vehicles_address() -> None:
    one, radio = link(keys=IN_USE), FrameSender(51, 68)
    one.takes(signer().heartbeat())
    assert one.takes(radio.radio_status()) is None
    assert one.takes(FrameSender(1, 1).radio_status()) is None
    assert one.takes(FrameSender(1, 1).radio_status(), FORGER) is RefusalKind.UNSIGNED


def test_a_phantom_of_the_same_forger_lets_no_radio_speak_as_the_vehicle() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    one.takes(vehicle.heartbeat())
    assert one.takes(FrameSender(42).heartbeat(), FORGER) is None
    assert one.takes(FrameSender(1, 1).radio_status(), FORGER) is RefusalKind.UNSIGNED


def test_a_radio_uses_up_nothing_of_a_signed_vehicles_rate() -> None:
    one, vehicle, radio = link(keys=IN_USE), signer(), FrameSender(1, 1)
    one.takes(vehicle.heartbeat())
    verdicts = [one.takes(radio.radio_status()) for _ in range(FRAMES_PER_S + 1)]
    assert verdicts[-1] is RefusalKind.TOO_FAST
    assert one.takes(vehicle.position()) is None


def test_phantoms_take_no_place_from_a_vehicle_with_a_key() -> None:
    one = link("?most_systems=3", keys=IN_USE)
    for number in range(100, 110):
        one.takes(FrameSender(number).heartbeat(), FORGER)
    assert one.takes(FrameSender(2).heartbeat()) is RefusalKind.TOO_MANY_SYSTEMS
    assert one.takes(signer().heartbeat()) is None


def test_noise_is_told_apart_from_forgery() -> None:
    one, frame = link(keys=IN_USE), bytearray(signer().heartbeat())
    frame[12] ^= 1
    assert one.takes(bytes(frame)) is RefusalKind.DAMAGED


def test_a_vehicle_without_a_clock_is_told_the_time_once_a_second() -> None:
    one, old = link(keys=IN_USE), signer(ahead_s=-86_400.0).heartbeat()
    assert one.takes(old) is RefusalKind.OLD_TIMESTAMP
    assert one.policy.answer_to_old(old, VEHICLE, one.now_s) == SigningKey(SECRET)
    assert one.policy.answer_to_old(old, VEHICLE, one.now_s + 0.9) is None
    assert one.policy.answer_to_old(old, VEHICLE, one.now_s + 1.0) is not None
    assert one.policy.answer_to_old(signer(system=2).heartbeat(), VEHICLE, one.now_s + 5.0) is None


def test_a_vehicle_is_told_the_time_with_the_key_that_it_signs_with() -> None:
    keys = {1: [StoredKey(SigningKey(SECRET), in_use=True), StoredKey(SigningKey(OTHER_SECRET))]}
    one, old = link(keys=keys), signer(OTHER_SECRET, ahead_s=-86_400.0).heartbeat()
    assert one.takes(old) is RefusalKind.OLD_TIMESTAMP
    assert one.policy.answer_to_old(old, VEHICLE, one.now_s) == SigningKey(OTHER_SECRET)


def test_a_played_recording_uses_up_no_answer_to_a_vehicle_wherever_that_is() -> None:
    one = link(keys={number: [StoredKey(SigningKey(SECRET), in_use=True)] for number in (1, 2)})
    old, other = signer(ahead_s=-86_400.0).heartbeat(), signer(system=2, ahead_s=-86_400.0).heartbeat()
    one.takes(signer().heartbeat())
    for number in range(2 * MOST_ANSWERED):
        one.policy.answer_to_old(old, Peer("10.0.0.66", f"10.0.0.66:{number}", is_allowed=True), one.now_s)
    assert one.policy.answer_to_old(old, VEHICLE, one.now_s) is not None
    assert one.policy.answer_to_old(old, SAME_HOST, one.now_s) is not None, "the vehicle may be at a new address"
    assert one.policy.answer_to_old(other, VEHICLE, one.now_s) is not None


def test_a_recording_played_at_the_former_address_does_not_keep_commands_there() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    recorded = vehicle.heartbeat()
    one.takes(recorded)
    moved = signer(ahead_s=60.0)
    for _ in range(20):
        assert one.takes(moved.position(), SAME_HOST, after_s=0.1) is None
        assert one.takes(recorded, VEHICLE) is RefusalKind.OLD_TIMESTAMP
    assert one.peers_of(TO_ONE.heartbeat()) == [SAME_HOST]


def test_frames_that_are_carried_to_another_connection_do_not_take_the_vehicle_there() -> None:
    one, vehicle = link(keys=IN_USE), signer()
    other = Link(LinkPolicy(ConnectionOptions(), one.signing), one.signing)
    assert one.takes(vehicle.heartbeat()) is None
    for _ in range(50):
        frame = vehicle.position()
        one.now_s = other.now_s = one.now_s + 0.1
        assert other.takes(frame, FORGER) is RefusalKind.OTHER_PEER, "it comes there first"
        assert one.takes(frame) is None
    assert other.takes(vehicle.heartbeat(), VEHICLE, after_s=SIGNED_PIN_S + 0.1) is None, "it really went there"


def test_late_copies_at_a_former_connection_do_not_claim_the_vehicle() -> None:
    former = link(keys=IN_USE)
    now, vehicle = Link(LinkPolicy(ConnectionOptions(), former.signing), former.signing), signer()
    assert former.takes(vehicle.heartbeat()) is None
    now.now_s = former.now_s + 2.0
    for _ in range(50):
        frame = vehicle.position()
        assert now.takes(frame, SAME_HOST, after_s=0.05) is None
        former.now_s = now.now_s + 0.03
        assert former.takes(frame) is RefusalKind.OLD_TIMESTAMP


def test_a_recording_of_another_stream_does_not_hold_a_vehicle_at_its_former_address() -> None:
    one = link(keys=IN_USE)
    one.takes(signer().heartbeat())
    recorded, moved = signer(component=191, link_id=5, ahead_s=-86_400.0).heartbeat(), signer(ahead_s=60.0)
    for _ in range(20):
        assert one.takes(moved.position(), SAME_HOST, after_s=0.1) is None
        assert one.takes(recorded, VEHICLE) is RefusalKind.OLD_TIMESTAMP
    assert one.peers_of(TO_ONE.heartbeat()) == [SAME_HOST]


def test_a_key_that_was_replaced_over_one_connection_is_replaced_on_all() -> None:
    one = link(keys={1: [StoredKey(SigningKey(SECRET), in_use=True), StoredKey(SigningKey(OTHER_SECRET))]})
    other = Link(LinkPolicy(ConnectionOptions(), one.signing), one.signing)
    one.takes(signer().heartbeat())
    assert other.takes(signer(OTHER_SECRET, ahead_s=10.0).heartbeat(), after_s=5.0) is None
    one.now_s = other.now_s
    assert one.takes(signer(OTHER_SECRET, ahead_s=20.0).heartbeat(), after_s=5.0) is None
    assert [route.key and route.key.secret for route in one.policy.routes(TO_ONE.heartbeat())] == [OTHER_SECRET]


def test_a_phantoms_radio_uses_up_nothing_of_a_vehicles_radio() -> None:
    one = link(keys=IN_USE)
    one.takes(signer().heartbeat())
    one.takes(FrameSender(77).heartbeat(), FORGER)
    radio = FrameSender(51, 68)
    verdicts = [one.takes(radio.radio_status(), FORGER) for _ in range(FRAMES_PER_S + 1)]
    assert verdicts[-1] is RefusalKind.TOO_FAST
    assert one.takes(radio.radio_status()) is None


def test_the_last_timestamp_of_a_misused_key_does_not_silence_the_next_one() -> None:
    keys = {1: [StoredKey(SigningKey(SECRET), in_use=True), StoredKey(SigningKey(OTHER_SECRET))]}
    one = link(keys=keys)
    assert one.takes(FrameSender(key=SECRET, timestamp=(1 << 48) - 1).heartbeat(), FORGER) is None
    assert one.takes(signer(OTHER_SECRET).heartbeat()) is None


def test_the_radios_of_phantoms_silence_no_radio_of_a_signed_vehicle() -> None:
    one = link(keys=IN_USE)
    for number in range(100, 100 + MOST_RADIOS):
        one.takes(FrameSender(number).heartbeat(), FORGER)
        assert one.takes(FrameSender(number + 50).radio_status(), FORGER) is None
    one.takes(signer().heartbeat())
    assert one.takes(FrameSender(51, 68).radio_status()) is None
    assert one.takes(FrameSender(52, 68).radio_status()) is not None, "one for each address beyond the four"


def test_timestamps_far_ahead_of_one_vehicle_refuse_no_other() -> None:
    other = b"o" * 32
    one = link(keys={**IN_USE, 2: [StoredKey(SigningKey(other), in_use=True)]})
    assert one.takes(FrameSender(key=SECRET, timestamp=(1 << 48) - 2).heartbeat()) is None
    assert one.takes(signer(other, system=2).heartbeat(), FORGER) is None
    clocks = one.signing.clocks
    assert clocks.of(SigningKey(SECRET)).last == (1 << 48) - 2
    assert clocks.of(SigningKey(other)).last < 1 << 47


def test_where_signing_is_off_keys_do_not_count() -> None:
    one = link("?signing=off", keys=IN_USE)
    assert one.takes(FrameSender().heartbeat()) is None
    assert one.policy.security(1) is LinkSecurity.PINNED


def test_keys_that_are_taken_away_leave_a_pinned_vehicle() -> None:
    one = link(keys=IN_USE)
    one.takes(signer().heartbeat())
    one.signing.ring.replace({})
    one.policy.keys_changed()
    assert one.policy.security(1) is LinkSecurity.PINNED
    assert one.takes(FrameSender().position()) is None
    assert [route.key for route in one.policy.routes(TO_ONE.heartbeat())] == [None]


def test_a_system_whose_key_in_use_is_removed_keeps_its_peer_and_is_signed_no_more() -> None:
    new = StoredKey(SigningKey(b"n" * 32))
    one = link(keys={1: [*IN_USE[1], new]})
    one.takes(signer().heartbeat())
    one.signing.ring.replace({1: [new]})
    one.policy.keys_changed()
    assert one.policy.security(1) is LinkSecurity.PINNED
    assert one.takes(FrameSender().heartbeat(), FORGER, after_s=0.1) is RefusalKind.OTHER_PEER
    assert one.peers_of(TO_ONE.heartbeat()) == [VEHICLE]


@pytest.mark.parametrize("query", ["?system=1", "?peer=10.0.0.0/24"])
def test_a_signature_does_not_open_what_the_operator_has_closed(query: str) -> None:
    one = link(query, keys={**IN_USE, 2: IN_USE[1]})
    stranger = Peer("192.168.0.1", "192.168.0.1:1", is_allowed=False)
    refused = {RefusalKind.SYSTEM_NOT_ALLOWED, RefusalKind.PEER_NOT_ALLOWED}
    assert one.takes(signer(system=2).heartbeat(), stranger) in refused
