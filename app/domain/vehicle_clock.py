"""How fast the vehicle's clock runs against ours: 1 on a real vehicle, the speed factor in a simulation."""

from __future__ import annotations

from dataclasses import dataclass, replace

WINDOW_S = 4.0
SHORTEST_S = 1.0
FASTEST = 100.0


@dataclass(frozen=True, slots=True)
class VehicleClock:
    """Samples of (our monotonic seconds, the vehicle's seconds since boot) over the last few seconds."""

    samples: tuple[tuple[float, float], ...] = ()

    def seen(self, now_s: float, boot_s: float) -> VehicleClock:
        """The clock after one more sample. A clock that jumps back (reboot) starts anew."""
        if self.samples and boot_s < self.samples[-1][1]:
            return VehicleClock(((now_s, boot_s),))
        if self.samples and now_s - self.samples[-1][0] < 0.1:
            return self
        kept = tuple(s for s in self.samples if now_s - s[0] <= WINDOW_S)
        return replace(self, samples=(*kept, (now_s, boot_s)))

    @property
    def is_measured(self) -> bool:
        """Whether there are samples over at least a second."""
        return len(self.samples) > 1 and self.samples[-1][0] - self.samples[0][0] >= SHORTEST_S

    @property
    def rate(self) -> float:
        """Vehicle seconds per second of ours; 1 until it is measured."""
        if not self.is_measured:
            return 1.0
        (first_now, first_boot), (last_now, last_boot) = self.samples[0], self.samples[-1]
        return min(FASTEST, max(0.01, (last_boot - first_boot) / (last_now - first_now)))
