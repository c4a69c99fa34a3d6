"""How a link guard identifies the other end of a link, and what it rejects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final


class LinkSecurity(StrEnum):
    """What keeps others from speaking for the vehicle, from nothing to a signature. See docs/explanation/security.md.

    `open`: any address that reaches the port. `pinned`: one address, or the other end of one wire. `signed`: nobody
    without the vehicle's key.
    """

    OPEN = "open"
    PINNED = "pinned"
    SIGNED = "signed"


_ORDER: Final = tuple(LinkSecurity)


def weaker(one: LinkSecurity | None, other: LinkSecurity | None) -> LinkSecurity | None:
    """Return the weaker of two; None means unknown and is ignored."""
    if one is None or other is None:
        return one or other
    return min(one, other, key=_ORDER.index)


class RefusalKind(StrEnum):
    """Why the guard let a frame not pass."""

    PEER_NOT_ALLOWED = "peer_not_allowed"
    """It came from an address that is none of the connection's `peer`s."""
    OTHER_PEER = "other_peer"
    """The vehicle is connected from another address."""
    SYSTEM_NOT_ALLOWED = "system_not_allowed"
    """Its system id is none of the connection's `system`s."""
    TOO_MANY_SYSTEMS = "too_many_systems"
    UNSIGNED = "unsigned"
    """The vehicle has a key, and the frame no signature."""
    BAD_SIGNATURE = "bad_signature"
    """The signature is not of a key of the vehicle."""
    OLD_TIMESTAMP = "old_timestamp"
    """The signature is valid, but not newer than the last one: a replay, or a vehicle that has just booted."""
    OTHER_LINK_ID = "other_link_id"
    """Signed rightly on another link of the vehicle, and carried over to this one."""
    TOO_FAST = "too_fast"
    TEXTS = "texts"
    """Too many STATUSTEXT messages."""
    LATE = "late"
    """It waited too long: the event loop was stalled, or more came than could be read. The latter are whole datagrams,
    a stranger's too, that were dropped unread.
    """
    CONGESTED = "congested"
    """The queue to the vehicle was full: the frame would arrive too late."""
    NOT_ANNOUNCED = "not_announced"
    """Nothing counts before the first HEARTBEAT."""
    GROUND_STATION = "ground_station"
    """The HEARTBEAT of another ground station."""
    DAMAGED = "damaged"
    """No whole frame, or one whose checksum does not fit."""


NOT_RECORDED: Final = frozenset({RefusalKind.NOT_ANNOUNCED, RefusalKind.GROUND_STATION, RefusalKind.DAMAGED})
"""They belong to every link's daily life: they are counted and not recorded."""


@dataclass(frozen=True, slots=True)
class Refused:
    """What one connection refused for one reason since it was opened, and where the newest of it came from.

    `systems`: system ids that were claimed, the first few of them.
    """

    connection: str
    kind: RefusalKind
    count: int
    peer: str
    systems: Sequence[int] = ()


@dataclass(frozen=True, slots=True)
class Relayed:
    """How many frames one connection let pass since it was opened, from its vehicles and to them."""

    connection: str
    from_vehicles: int
    to_vehicles: int
