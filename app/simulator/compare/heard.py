"""What both sides of a comparison consist of: messages of a vehicle, with the time on one axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Fields = dict[str, Any]
Address = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Heard:
    """A message from the vehicle. `t_s` is vehicle time since the first power-up, running on over restarts."""

    t_s: float
    name: str
    fields: Fields
    link: str | None = None


@dataclass(frozen=True, slots=True)
class Sent:
    """A message of a ground station; None in a field is a NaN."""

    t_s: float
    name: str
    fields: Fields
    source: Address
    link: str | None = None


@dataclass(frozen=True, slots=True)
class Dialogue:
    """One side of a comparison: what was sent to a vehicle, and what was heard from it."""

    sent: tuple[Sent, ...]
    heard: tuple[Heard, ...]

    def named(self, *names: str) -> list[Heard]:
        """The heard messages with these names, in order."""
        return [one for one in self.heard if one.name in names]

    def broadcast(self, name: str) -> list[Heard]:
        """One link's copy of a message that is sent on every link."""
        return [one for one in self.heard if one.name == name and one.link is None]

    def acts_s(self) -> list[float]:
        """When the ground did something; heartbeats are no deed."""
        return [one.t_s for one in self.sent if one.name != "HEARTBEAT"]
