"""How much of the event loop's time a peer may use: a flood from one leaves the rest to all others."""

from __future__ import annotations

from typing import Final

_PAUSE_S: Final = 0.05
_MOST_DEBT_S: Final = 1.0
"""Nobody waits longer, however much others have used."""


class RateBudget:
    """So many units a second. A unit is a frame, or a datagram or piece of a stream that carries none."""

    def __init__(self, per_s: float, *, burst_s: float = _PAUSE_S, pool: RateBudget | None = None) -> None:
        """`burst_s`: so many seconds' worth may be used at once. `pool`: what all peers together may use beyond."""
        self._of_one = per_s
        self._burst_s = burst_s
        self._pool = pool
        self._times = 1
        self._left = per_s * burst_s
        self._at_s = 0.0

    def widen(self, times: int) -> None:
        """So many vehicles share it."""
        self._times = max(1, times)

    def spend(self, units: float, now_s: float) -> float:
        """So many units were used. For how many seconds nothing more may be read; 0: go on."""
        left = self._refilled(now_s) - units
        if left <= 0 and self._pool is not None and self._pool.grants(-left, now_s):
            self._left = 0.0
            return 0.0
        per_s = self._of_one * self._times
        self._left = max(left, -per_s * _MOST_DEBT_S)
        return 0.0 if left > 0 else _PAUSE_S - self._left / per_s

    def grants(self, units: float, now_s: float) -> bool:
        """Whether there are so many, which are used then."""
        left = self._refilled(now_s)
        granted = left >= units
        self._left = left - units if granted else left
        return granted

    def _refilled(self, now_s: float) -> float:
        per_s = self._of_one * self._times
        left = min(per_s * self._burst_s, self._left + (now_s - self._at_s) * per_s)
        self._at_s = now_s
        return left


UNKNOWN_PEERS_PER_S: Final = 10_000.0
VEHICLE_PER_S: Final = 1_000.0
"""Of a vehicle, whatever the others send: 500 datagrams with a frame each, more than twice what a busy link carries."""
POOL_PER_S: Final = 12_000.0
"""Of all vehicles of a connection together, beyond their own."""


class RateBudgets:
    """Of one connection: what all peers use from which no vehicle is heard, and what vehicles use beyond their own."""

    def __init__(self, unknown_peers_per_s: float = UNKNOWN_PEERS_PER_S) -> None:
        self.unknown_peers = RateBudget(unknown_peers_per_s)
        self._pool = RateBudget(POOL_PER_S, burst_s=0.5)

    def of_vehicle(self) -> RateBudget:
        """Of a peer from which vehicles are heard. What waited while the process stood still is read at once."""
        return RateBudget(VEHICLE_PER_S, burst_s=1.0, pool=self._pool)
