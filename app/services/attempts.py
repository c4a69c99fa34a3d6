"""Limits failed authentications of each client address."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict
from dataclasses import dataclass
from typing import Final

from app.services.clock import Clock

MOST_FAILURES: Final = 10
WINDOW_S: Final = 60.0
ADDRESSES_KEPT: Final = 4096


@dataclass(slots=True)
class _Failures:
    since_s: float
    count: int = 0


class FailedAttempts:
    """At most MOST_FAILURES of an address in WINDOW_S. A host of IPv6 has a whole /64, so that counts as one."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._failures: OrderedDict[str, _Failures] = OrderedDict()

    def count(self, address: str) -> None:
        """One more. Of many addresses those that failed last are remembered."""
        key = _network(address)
        found = self._current(key) or _Failures(self._clock.monotonic())
        found.count += 1
        self._failures[key] = found
        self._failures.move_to_end(key)
        if len(self._failures) > ADDRESSES_KEPT:
            self._failures.popitem(last=False)

    def retry_after_s(self, address: str) -> float | None:
        """How long the address has to wait; None: it may try."""
        found = self._current(_network(address))
        if found is None or found.count < MOST_FAILURES:
            return None
        return found.since_s + WINDOW_S - self._clock.monotonic()

    def _current(self, key: str) -> _Failures | None:
        found = self._failures.get(key)
        return None if found is None or self._clock.monotonic() >= found.since_s + WINDOW_S else found


def _network(address: str) -> str:
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if isinstance(parsed, ipaddress.IPv6Address):
        if parsed.ipv4_mapped is not None:
            return str(parsed.ipv4_mapped)
        return str(ipaddress.ip_network((parsed, 64), strict=False))
    return str(parsed)
