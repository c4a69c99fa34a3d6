"""Waits of blocking clients: for a condition, with a deadline that ends a hang and promises nothing about speed."""

from __future__ import annotations

import time
from collections.abc import Callable

from tests.support.patience import Patience

HANG_S = 30.0


def until(condition: Callable[[], object], promise: str, within_s: float = HANG_S) -> None:
    """Look every 20 ms; AssertionError names the promise."""
    patience = Patience(within_s)
    while not condition():
        assert not patience.is_over(), f"{promise} within {within_s:g} s"
        time.sleep(0.02)
