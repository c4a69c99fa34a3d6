"""Which frames pass. Pure: frames, peers and times come in, a refusal or none comes out.

An unsigned vehicle is heard from one peer at a time, the first that shows its HEARTBEAT. A vehicle with a key in use is
heard from wherever its signature comes, and answered where it was heard last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from app.domain.vehicle.link_security import LinkSecurity, RefusalKind
from app.vehicles.link_guard import frames
from app.vehicles.link_guard.keyring import KeyRing, VehicleKeys
from app.vehicles.link_guard.options import ConnectionOptions
from app.vehicles.link_guard.signing import SigningClocks, SigningKey, StreamKey, StreamTimes, signature_of, ticks

PIN_S: Final = 30.0
"""So long a vehicle must be silent before it is believed at another address."""
PIN_SAME_ADDRESS_S: Final = 3.0
"""The same for another port of its address, and between peers that the operator names: a vehicle that restarts, or
whose router forgets it, comes back on another port.
"""
SIGNED_PIN_S: Final = 1.0
"""A signature identifies the sender; after so much silence at the old address it is answered at the new one."""

FRAMES_PER_S: Final = 2000
"""Of one vehicle: ten times what a busy link carries."""
TEXTS_PER_S: Final = 10.0
TEXTS_AT_ONCE: Final = 60.0
"""STATUSTEXT frames; a text has up to six."""
MOST_RADIOS: Final = 4
MOST_RADIO_RATES: Final = 64
ANSWER_S: Final = 1.0
"""An old timestamp is answered so often at most."""
MOST_ANSWERED: Final = 256
"""Places that are remembered for that."""
MOST_GROUND_STATIONS: Final = 64


class Peer:
    """One place at the other end: an address and port, a TCP connection, a serial device. Compared by identity."""

    __slots__ = ("address", "is_allowed", "name")

    def __init__(self, address: str, name: str, *, is_allowed: bool) -> None:
        self.address = address
        self.name = name
        self.is_allowed = is_allowed


class Route(NamedTuple):
    """Where frames for a system go, and signed with what."""

    peer: Peer
    key: SigningKey | None


@dataclass(slots=True)
class _Rate:
    """How much of one system's frames, and of its texts, has passed lately."""

    window_s: float = 0.0
    frames: int = 0
    texts: float = TEXTS_AT_ONCE
    texts_s: float = 0.0

    def judge(self, message: int, now_s: float) -> RefusalKind | None:
        """One more frame."""
        if now_s - self.window_s >= 1.0:
            self.window_s, self.frames = now_s, 0
        self.frames += 1
        if self.frames > FRAMES_PER_S:
            return RefusalKind.TOO_FAST
        if message != frames.STATUSTEXT:
            return None
        self.texts = min(TEXTS_AT_ONCE, self.texts + (now_s - self.texts_s) * TEXTS_PER_S)
        self.texts_s = now_s
        if self.texts < 1.0:
            return RefusalKind.TEXTS
        self.texts -= 1.0
        return None


@dataclass(slots=True)
class _System:
    """One system id, admitted once. `links` are the link ids of its components' signatures, with their last time."""

    peer: Peer
    heard_s: float
    signed: bool = False
    gone: bool = False
    rate: _Rate = field(default_factory=_Rate)
    links: dict[int, tuple[int, float]] = field(default_factory=dict)


class Signing:
    """What all connections of a process share: the keys, their clocks, and what was heard of each signed stream."""

    def __init__(self, ring: KeyRing, clocks: SigningClocks, times: StreamTimes) -> None:
        self.ring = ring
        self.clocks = clocks
        self.times = times
        self._heard: dict[int, tuple[object, float]] = {}

    def current(self, number: int) -> SigningKey | None:
        """The key that this system is known to use, on whichever connection it was heard with it."""
        keys = self.ring.of(number)
        return None if keys is None else keys.current

    def heard(self, number: int, connection: object, now_s: float) -> None:
        """A signed frame of this system was taken on this connection."""
        self._heard[number] = (connection, now_s)

    def is_heard_elsewhere(self, number: int, connection: object, now_s: float) -> bool:
        """Whether it is heard on another connection: what comes here was carried here, and commands would follow it."""
        where, heard_s = self._heard.get(number, (connection, now_s))
        return where is not connection and now_s - heard_s <= SIGNED_PIN_S


class LinkPolicy:
    """One connection. Systems that were admitted once keep their place, so that their number stays bounded."""

    def __init__(self, options: ConnectionOptions, signing: Signing) -> None:
        self._options = options
        self._signing = signing
        self._systems: dict[int, _System] = {}
        self._anybody: dict[Peer, float] = {}
        self._radios: dict[int, str] = {}
        self._radio_rates: dict[tuple[int, str], _Rate] = {}
        self._ground_stations: dict[tuple[int, Peer], float] = {}
        self._answered_s: dict[tuple[int, str], float] = {}
        self._routes: dict[int, tuple[Route, ...]] = {}
        self._everywhere: tuple[Route, ...] = ()

    def admit(self, frame: bytes, peer: Peer, now_s: float, unix_s: float) -> RefusalKind | None:
        """Judge one whole frame from outside. `now_s` is monotonic. None: it passes."""
        number = frames.system_id(frame)
        system = self._systems.get(number)
        keys = self._signing.ring.of(number) if self._options.signing else None
        if keys is not None and (keys.required or frames.is_signed(frame)):
            refusal = self._judge_signed(frame, number, keys, peer, now_s, unix_s)
        elif system is not None and system.peer is peer and not (system.signed or self._options.any_peer):
            system.heard_s = now_s
            refusal = None
        else:
            refusal = self._judge_unsigned(frame, number, peer, now_s)
        if refusal is None:
            system = self._systems.get(number)
            if system is None or (system.signed and not frames.is_signed(frame)):  # it uses up nothing of a vehicle's
                if len(self._radio_rates) > MOST_RADIO_RATES:
                    self._radio_rates.clear()
                rate = self._radio_rates.setdefault((number, peer.address), _Rate())
            else:
                rate = system.rate
            refusal = rate.judge(frames.message_id(frame), now_s)
        elif peer.is_allowed and _is_of_ground_station(frame):
            self._note_ground_station(number, peer, now_s)
        return refusal

    def ground_station_heard_s(self, number: int, station: int) -> float | None:
        """When the HEARTBEAT of a ground station came from where this vehicle is heard (monotonic); None: never."""
        system = self._systems.get(number)
        return None if system is None else self._ground_stations.get((station, system.peer))

    def _note_ground_station(self, station: int, peer: Peer, now_s: float) -> None:
        self._ground_stations.pop((station, peer), None)
        self._ground_stations[station, peer] = now_s
        if len(self._ground_stations) > MOST_GROUND_STATIONS:
            del self._ground_stations[next(iter(self._ground_stations))]

    def routes(self, frame: bytes) -> Sequence[Route]:
        """Where a frame of ours goes: to its target, or to every peer that has a vehicle."""
        if len(self._routes) > 1:
            target = frames.target_system(frame)
            if target:
                return self._routes.get(target, ())
        return self._everywhere

    def routes_to(self, number: int) -> Sequence[Route]:
        """Where frames for one system go; nowhere before it was heard."""
        return self._routes.get(number, ())

    def owns(self, peer: Peer) -> bool:
        """Whether a system is heard from it."""
        return peer in self._anybody or any(system.peer is peer for system in self._systems.values())

    def systems_of(self, peer: Peer) -> int:
        """How many systems are heard from it."""
        return sum(system.peer is peer for system in self._systems.values())

    def lost(self, peer: Peer) -> None:
        """It is not there any more: its vehicles may come back from another port of its address at once."""
        self._anybody.pop(peer, None)
        for system in self._systems.values():
            system.gone = system.gone or system.peer is peer
        self._lay_routes()

    def security(self, number: int) -> LinkSecurity:
        """What keeps others from speaking for this system."""
        system = self._systems.get(number)
        if system is not None and system.signed:
            return LinkSecurity.SIGNED
        return LinkSecurity.OPEN if self._options.any_peer else LinkSecurity.PINNED

    def answer_to_old(self, frame: bytes, peer: Peer, now_s: float) -> SigningKey | None:
        """With what to sign a HEARTBEAT for the sender of a frame whose timestamp is old, once a second; None: not now.

        A vehicle without a clock begins where it was given its key, and takes our time from the first frame of ours
        that it verifies. Whoever plays a recording gets no more than a HEARTBEAT, and uses up neither the answers to
        other systems nor those to this one at another place.
        """
        number = frames.system_id(frame)
        keys, place = self._signing.ring.of(number), (number, peer.name)
        if keys is None or now_s - self._answered_s.get(place, -ANSWER_S) < ANSWER_S:
            return None
        self._answered_s.pop(place, None)
        self._answered_s[place] = now_s
        if len(self._answered_s) > MOST_ANSWERED:
            del self._answered_s[next(iter(self._answered_s))]
        return keys.find(frame)

    def _judge_signed(
        self, frame: bytes, number: int, keys: VehicleKeys, peer: Peer, now_s: float, unix_s: float
    ) -> RefusalKind | None:
        system = self._systems.get(number)
        if not frames.is_signed(frame):
            return None if self._is_of_radio(frame, number, peer) else RefusalKind.UNSIGNED
        key = keys.find(frame)
        if key is None:
            return RefusalKind.BAD_SIGNATURE if frames.is_intact(frame) else RefusalKind.DAMAGED
        if refusal := self._not_allowed(number, peer):
            return refusal
        link_id, timestamp = signature_of(frame)
        component = frames.component_id(frame)
        stream = StreamKey(key.fingerprint, number, component, link_id)
        times, clock = self._signing.times, self._signing.clocks.of(key)
        is_here = system is not None and system.peer is peer and system.signed
        elsewhere = self._signing.is_heard_elsewhere(number, self, now_s)
        if not times.is_new(stream, timestamp, max(clock.last, ticks(unix_s))):
            if is_here and not elsewhere and times.is_recent(stream, timestamp):
                self._hear(number, now_s)  # somebody carried it to another peer faster than it came here
            return RefusalKind.OLD_TIMESTAMP
        if elsewhere:
            return RefusalKind.OTHER_PEER
        if system is not None and self._is_carried_over(system, component, link_id, now_s):
            return RefusalKind.OTHER_LINK_ID
        times.accept(stream, timestamp)
        clock.observe(timestamp)
        switched = self._signing.ring.verified(number, key)
        self._heard_signed(number, peer, component, link_id, now_s, changed=switched)
        return None

    def _hear(self, number: int, now_s: float) -> None:
        """A signed system was heard at its peer here."""
        self._systems[number].heard_s = now_s
        self._signing.heard(number, self, now_s)

    def _is_carried_over(self, system: _System, component: int, link_id: int, now_s: float) -> bool:
        before = system.links.get(component)
        return before is not None and before[0] != link_id and now_s - before[1] < PIN_S

    def _heard_signed(
        self, number: int, peer: Peer, component: int, link_id: int, now_s: float, *, changed: bool
    ) -> None:
        system = self._systems.get(number)
        if system is None:
            system = self._systems[number] = _System(peer, now_s)
            changed = True
        is_free = not system.signed or system.gone or now_s - system.heard_s > SIGNED_PIN_S
        moved = system.peer is not peer and is_free
        if moved:
            system.peer, system.gone = peer, False
        system.links[component] = (link_id, now_s)
        if system.peer is peer:
            self._hear(number, now_s)
        if changed or moved or not system.signed or self._routes[number][0].key is not self._signing.current(number):
            system.signed = True
            self._lay_routes()

    def _judge_unsigned(self, frame: bytes, number: int, peer: Peer, now_s: float) -> RefusalKind | None:
        if refusal := self._not_allowed(number, peer):
            return refusal
        system = self._systems.get(number)
        if system is not None and self._options.any_peer:
            system.heard_s = now_s
            self._hear_anybody(peer, now_s)
            return None
        if system is not None and not system.signed and now_s - system.heard_s < self._pin_s(system, peer):
            return RefusalKind.OTHER_PEER
        if self._is_of_radio(frame, number, peer):
            return None
        if frames.message_id(frame) != frames.HEARTBEAT:
            return RefusalKind.NOT_ANNOUNCED
        if not frames.is_intact(frame):
            return RefusalKind.DAMAGED
        if _is_of_ground_station(frame):
            return RefusalKind.GROUND_STATION
        self._systems[number] = _System(peer, now_s)
        self._hear_anybody(peer, now_s)
        self._lay_routes()
        return None

    def _not_allowed(self, number: int, peer: Peer) -> RefusalKind | None:
        options = self._options
        if not peer.is_allowed:
            return RefusalKind.PEER_NOT_ALLOWED
        if options.systems and number not in options.systems:
            return RefusalKind.SYSTEM_NOT_ALLOWED
        has_key = options.signing and self._signing.ring.of(number) is not None  # its place is kept for it
        if number not in self._systems and not has_key and len(self._systems) >= options.most_systems:
            return RefusalKind.TOO_MANY_SYSTEMS
        return None

    def _pin_s(self, system: _System, peer: Peer) -> float:
        near = bool(self._options.peers) or system.peer.address == peer.address
        if near:
            return 0.0 if system.gone else PIN_SAME_ADDRESS_S
        return PIN_S

    def _is_of_radio(self, frame: bytes, number: int, peer: Peer) -> bool:
        """RADIO_STATUS, which a radio puts into the stream of the vehicle behind it, unsigned and as its own system."""
        system = self._systems.get(number)
        if frames.message_id(frame) != frames.RADIO_STATUS or not self.owns(peer):
            return False
        if system is not None and system.peer is not peer:
            return False
        behind = self._radios.get(number)
        if behind is None and (len(self._radios) < MOST_RADIOS or self._is_free_for_radio(peer)):
            self._radios[number] = peer.address
        return number in self._radios

    def _is_free_for_radio(self, peer: Peer) -> bool:
        """Whether a signed vehicle is heard from there, whose radio has no place yet: phantoms may have taken all."""
        signed = any(system.peer is peer and system.signed for system in self._systems.values())
        return signed and peer.address not in self._radios.values()

    def _hear_anybody(self, peer: Peer, now_s: float) -> None:
        """On an open connection everybody who speaks for a vehicle is answered, as mavsdk does."""
        if not self._options.any_peer:
            return
        is_new = peer not in self._anybody
        if is_new and len(self._anybody) >= self._options.most_systems:
            del self._anybody[min(self._anybody, key=self._anybody.__getitem__)]
        self._anybody[peer] = now_s
        if is_new:
            self._lay_routes()

    def keys_changed(self) -> None:
        """The key file was read again. A system whose key in use is gone is heard unsigned from now on."""
        for number, system in self._systems.items():
            keys = self._signing.ring.of(number)
            system.signed = system.signed and keys is not None and keys.required
        self._lay_routes()

    def _lay_routes(self) -> None:
        everybody = [Route(peer, None) for peer in self._anybody]
        self._routes = {}
        for number, system in self._systems.items():
            own = Route(system.peer, self._signing.current(number) if system.signed else None)
            self._routes[number] = tuple(everybody) if everybody and not system.signed else (own,)
        self._everywhere = tuple(dict.fromkeys(route for routes in self._routes.values() for route in routes))


def _is_of_ground_station(frame: bytes) -> bool:
    """Whether it is the HEARTBEAT of a ground station."""
    if frames.message_id(frame) != frames.HEARTBEAT or not frames.is_intact(frame):
        return False
    return frames.payload(frame)[4:5] == bytes([frames.MAV_TYPE_GCS])
