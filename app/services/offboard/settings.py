"""Times, rates and limits of offboard control."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from app.domain.offboard.limits import OffboardLimits
from app.domain.offboard.step import DeadMan

SLOWEST_HZ: Final = 20.0
FASTEST_HZ: Final = 50.0


@dataclass(frozen=True, slots=True)
class OffboardSettings:
    """`lease_s`: a lease that its holder does not use or renew ends. `stream_s`: the stream before the mode switch.

    `gap_s`: ticks farther apart mean that the process or the machine stood still; less than any COM_OF_LOSS_T.
    `fresh_s`: how old a position may be to count as an estimate; it comes at 10 Hz. `calm_s`: how long a failsafe may
    still be reported after Hold. `goodbye_s`: how long a stop of the service waits for Hold.
    """

    rate_hz: float = SLOWEST_HZ
    limits: OffboardLimits = field(default_factory=OffboardLimits)
    dead_man: DeadMan = field(default_factory=DeadMan)
    lease_s: float = 10.0
    stream_s: float = 1.0
    gap_s: float = 0.8
    fresh_s: float = 2.0
    calm_s: float = 3.0
    goodbye_s: float = 2.0
