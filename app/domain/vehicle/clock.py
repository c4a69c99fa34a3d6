"""A vehicle's clock against ours: how fast it runs, and how fast it may run for decisions that are made live."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, replace
from typing import Final

WINDOW_S = 4.0
SHORTEST_S = 1.0
FASTEST = 100.0
LATE_S = 1.0
"""A message may come this much later than others did, without evidence of a faster clock."""

OVERTAKEN_S = 2.0
"""Of ours: a message may be overtaken by others that left so much later. A reboot sets the clock back further."""


@dataclass(frozen=True, slots=True)
class VehicleClock:
    """Samples of (monotonic seconds of the service, seconds since boot of the vehicle) over the last few seconds.

    `commanded_rate` is the rate that a simulator was set to: it applies until the clock is measured again.
    """

    samples: tuple[tuple[float, float], ...] = ()
    window_s: float = WINDOW_S
    commanded_rate: float | None = None

    def seen(self, now_s: float, boot_s: float) -> VehicleClock:
        """The clock after one more sample. A clock that jumps back (reboot) starts anew; one overtaken is left out."""
        back_s = self.samples[-1][1] - boot_s if self.samples else 0.0
        if back_s > 0.0:
            return self if self.is_overtaken(back_s) else replace(self, samples=((now_s, boot_s),))
        if self.samples and now_s - self.samples[-1][0] < 0.1:
            return self
        kept = self.samples[bisect_left(self.samples, (now_s - self.window_s,)) :]
        return replace(self, samples=(*kept, (now_s, boot_s)))

    def set_to(self, rate: float) -> VehicleClock:
        """The clock when its speed is changed: what was measured before is not true any more."""
        return replace(self, samples=(), commanded_rate=rate)

    def is_overtaken(self, back_s: float) -> bool:
        """Whether a message that far behind the newest, in vehicle time, has only come late on a reordering link."""
        return 0.0 < back_s < OVERTAKEN_S * max(1.0, self.rate)

    @property
    def is_measured(self) -> bool:
        """Whether there are samples over at least a second."""
        return self._span_s >= SHORTEST_S

    @property
    def is_full(self) -> bool:
        """Whether more samples add no information."""
        return self._span_s >= self.window_s - SHORTEST_S

    @property
    def least_rate(self) -> float | None:
        """The clock runs at least this fast with certainty; until it is measured the commanded rate, or None.

        A stalled link delivers many messages at once, which looks like a fast clock. So each half of the samples must
        show it, with some of them LATE_S late.
        """
        if not self.is_measured:
            return self.commanded_rate
        first, last = self.samples[0], self.samples[-1]
        middle = next(sample for sample in self.samples if 2.0 * sample[0] >= first[0] + last[0])
        halves = ((first, middle), (middle, last))
        return min((end[1] - begin[1]) / (end[0] - begin[0] + LATE_S) for begin, end in halves)

    @property
    def _span_s(self) -> float:
        return self.samples[-1][0] - self.samples[0][0] if self.samples else 0.0

    @property
    def rate(self) -> float:
        """Vehicle seconds per second of the service; until it is measured the commanded rate, or 1."""
        if not self.is_measured:
            return 1.0 if self.commanded_rate is None else self.commanded_rate
        (first_now, first_boot), (last_now, last_boot) = self.samples[0], self.samples[-1]
        return min(FASTEST, max(0.01, (last_boot - first_boot) / (last_now - first_now)))

    @property
    def sure_rate(self) -> float:
        """`rate` if it is certainly faster than 1, else 1: the clock of a real vehicle only appears faster or
        slower, because of link delays.
        """
        return self.rate if (self.least_rate or 1.0) > 1.0 else 1.0


UNMEASURED: Final = VehicleClock()


# How fast a vehicle's clock may run for what is decided here, live: supervised drops, and OFFBOARD.
#
# The timers on our side (acks, retries, the age of a position) are wall clock. In a simulation with a speed factor
# the vehicle moves on that much further within each of them, so that beyond MAX_LIVE_RATE their promises do not hold.


MAX_LIVE_RATE: Final = 4.0
"""Vehicle seconds in one of ours; 1 on every real vehicle."""
SUSPECT_RATE: Final = 1.1 * MAX_LIVE_RATE
"""A measured rate above this may be chance (messages arrive late and in bursts): then more samples are needed."""
TOO_FAST_HINT: Final = f"slow the simulation down to {MAX_LIVE_RATE:g}x, or make the drop embedded"


def is_too_fast(least_rate: float | None) -> bool:
    """Whether the vehicle's clock surely runs too fast. Unknown (None) is not sure."""
    return least_rate is not None and least_rate > MAX_LIVE_RATE


def too_fast_words(least_rate: float) -> str:
    """A sentence's beginning, for people."""
    return (
        f"the vehicle's clock runs at least {least_rate:.1f} times as fast as ours, "
        f"and supervised drops work up to {MAX_LIVE_RATE:g} times"
    )


def needs_longer_look(clock: VehicleClock) -> bool:
    """Whether it may run too fast and the samples do not decide it yet."""
    return clock.rate > SUSPECT_RATE and not clock.is_full and not is_too_fast(clock.least_rate)
