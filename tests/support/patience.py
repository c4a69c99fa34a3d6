"""How long a test waits for something: a machine that stands still uses none of it up."""

from __future__ import annotations

import time
from typing import Final

STEP_S: Final = 0.5
"""A longer time between two looks counts as this: what is waited for stood still, too."""


class Patience:
    """Ends a wait that would last for ever. It promises nothing about speed."""

    def __init__(self, within_s: float) -> None:
        self._left_s = within_s
        self._looked_s = time.monotonic()

    def is_over(self) -> bool:
        """To be asked at each look."""
        now_s = time.monotonic()
        self._left_s -= min(now_s - self._looked_s, STEP_S)
        self._looked_s = now_s
        return self._left_s <= 0.0
