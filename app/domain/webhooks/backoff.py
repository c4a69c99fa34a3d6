"""How long to wait before a message is sent again."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Backoff:
    """Waits double from `first_s` to `longest_s`; a part of each is chance, so that hooks do not come in step."""

    first_s: float = 2.0
    longest_s: float = 3600.0

    def wait_s(self, failures: int, *, chance: float, asked_s: float | None = None) -> float:
        """The wait after so many failures in a row (1 or more).

        `chance` is in [0, 1): the wait lies between half of its step and the whole. `asked_s` is the receiver's
        Retry-After: it is not asked again before, but never later than `longest_s`.
        """
        doublings = min(max(failures, 1) - 1, 60)  # 2**60 steps are longer than any cap
        step_s = min(self.first_s * 2.0**doublings, self.longest_s)
        wait_s = step_s * (0.5 + 0.5 * chance)
        return wait_s if asked_s is None else min(max(wait_s, asked_s), self.longest_s)
