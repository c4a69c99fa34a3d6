"""One direction of a link: what its faults do to each datagram on the way."""

from __future__ import annotations

import random
from collections.abc import Callable

from app.simulator.faults import LinkFaults

REORDER_HOLD_S = 0.05

Deliver = Callable[[], None]
Later = Callable[[float, Deliver], object]
"""Calls something so many wall-clock seconds later."""


class FaultyWay:
    """Its chances come from its own `rng` alone, one draw after the other: what comes the other way changes nothing."""

    def __init__(self, faults: LinkFaults, rng: random.Random, later: Later) -> None:
        self._faults = faults
        self._rng = rng
        self._later = later

    def carry(self, deliver: Deliver) -> None:
        """Deliver one datagram: now, later, twice or not at all."""
        faults = self._faults
        if faults.link_cut or (faults.loss and self._rng.random() < faults.loss):
            return
        copies = 2 if faults.duplicate and self._rng.random() < faults.duplicate else 1
        for _ in range(copies):
            wait_s = faults.delay_s + (self._rng.random() * faults.jitter_s if faults.jitter_s else 0.0)
            if faults.reorder and self._rng.random() < faults.reorder:
                wait_s += REORDER_HOLD_S
            if wait_s > 0.0:
                self._later(wait_s, deliver)
            else:
                deliver()
