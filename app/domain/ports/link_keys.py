"""The port to the signing keys of the vehicle links, as the operator's commands see them: never the secrets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from app.domain.errors import InvalidInputError


class LinkKeyError(InvalidInputError, code="link_key.invalid"):
    """The signing keys of the vehicle links cannot be used, or not so."""


@dataclass(frozen=True, slots=True)
class LinkKey:
    """One key of one system. `created` is ISO 8601 in UTC; `in_use`: the vehicle signs with it, or is said to."""

    system_id: int
    fingerprint: str
    created: str
    in_use: bool


class LinkKeys(Protocol):
    """The keys on this machine. Every method raises LinkKeyError if the files cannot be used."""

    def create(self, system_id: int, secret: bytes | None = None) -> LinkKey:
        """Make a key, or take one that the vehicle has already. Two for each vehicle at most."""

    def list_keys(self) -> Sequence[LinkKey]:
        """All of them, by system id, oldest first."""

    def remove(self, system_id: int, fingerprint: str) -> None:
        """Forget a key: frames that it signed are refused from then on."""
