"""How fast a vehicle's clock may run for what is decided here, live: supervised drops, and OFFBOARD.

The timers on our side (acks, retries, the age of a position) are wall clock. In a simulation with a speed factor the
vehicle moves on that much further within each of them, so that beyond MAX_LIVE_RATE their promises do not hold.
"""

from __future__ import annotations

from typing import Final

from app.domain.vehicle_clock import VehicleClock

MAX_LIVE_RATE: Final = 4.0
"""Vehicle seconds in one of ours; 1 on every real vehicle."""
SUSPECT_RATE: Final = 1.1 * MAX_LIVE_RATE
"""A measured rate above this may be chance (messages come late and in heaps): then more of them must be heard."""
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
    """It may run too fast, and what was heard so far does not decide it."""
    return clock.rate > SUSPECT_RATE and not clock.is_full and not is_too_fast(clock.least_rate)
