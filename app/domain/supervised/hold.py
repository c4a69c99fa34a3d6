"""How much of the bounded hold is left, counted from the earliest moment at which it can have begun."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.domain.supervised.inputs import Observation
from app.domain.supervised.terms import LATE_SIGN_S, OUTSIDE_MARGIN_M, DropTerms
from app.domain.vehicle import FlightMode, LandedState


@dataclass(frozen=True, slots=True)
class HoldClock:
    """`not_begun_at_s`: the vehicle's time at which the hold had surely not begun; None if that was never seen."""

    not_begun_at_s: float | None = None

    def observed(self, seen: Observation, terms: DropTerms) -> HoldClock:
        """The clock after an observation. Law: with more observations the time left is never over-estimated."""
        if seen.boot_s is None or not seen.connected:
            return self
        sign_s = _surely_before(seen, terms)
        if sign_s is None or (self.not_begun_at_s is not None and sign_s <= self.not_begun_at_s):
            return self
        return replace(self, not_begun_at_s=sign_s)

    def left_s(self, seen: Observation, terms: DropTerms) -> float:
        """Seconds of our time surely left; 0 or less if it may be over or its start was not seen."""
        if self.not_begun_at_s is None or seen.boot_s is None or seen.position_age_s is None:
            return 0.0
        vehicle_now_s = seen.boot_s + seen.position_age_s * seen.clock_rate
        return (self.not_begun_at_s + terms.hold_s - vehicle_now_s) / max(seen.clock_rate, 0.01)

    def waits_longer_than(self, needed_s: float, seen: Observation, terms: DropTerms) -> bool:
        """Whether the vehicle surely still waits for so long, the time to leave for an alternate included."""
        is_known = self.not_begun_at_s is not None and seen.boot_s is not None and seen.position_age_s is not None
        return is_known and self.left_s(seen, terms) + terms.leave_s / max(seen.clock_rate, 0.01) > needed_s


def _surely_before(seen: Observation, terms: DropTerms) -> float | None:
    """The vehicle's time up to which this observation proves that the hold had not begun; None if it proves nothing."""
    assert seen.boot_s is not None
    late_s = seen.boot_s - LATE_SIGN_S
    if seen.mode is not FlightMode.MISSION:
        return late_s  # PX4 starts the item anew when Mission mode is entered again
    if seen.mission_seq is not None and seen.mission_seq not in terms.hold_seqs:
        return late_s
    if terms.landed:
        return late_s if seen.landed is not LandedState.ON_GROUND else None
    if seen.offset_m is not None and seen.offset_m > terms.acceptance_radius_m + OUTSIDE_MARGIN_M:
        return seen.boot_s
    return None
