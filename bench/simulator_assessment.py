"""Whether the simulated vehicles keep up: 100 of them in real time on one core, at 10 messages a second each.

The promise is judged by CPU and by the vehicles' own clock, not by the wall clock alone: a core that others use as well
is given late, which says nothing of the simulator.
"""

from __future__ import annotations

from dataclasses import dataclass

KEPT, BROKEN, NOT_MEASURED = 0, 1, 2
"""Exit statuses."""
REAL_TIME = 0.98
MESSAGES_PER_S, FEWEST_PER_S = 9.5, 8.0
"""Of vehicle time: on average, and by each vehicle (a short time cuts off a message at either end)."""
MOST_REFERENCES = 5.0
"""CPU for a second of one vehicle, in reference loops: more than twice what 25 vehicles were found to take."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One run. `cpu_of_core` is the share of a core that the wanted speed takes, measured or not reached."""

    factor: float
    """Vehicle time over wall time, as a share of the wanted speed."""
    cpu_of_core: float
    messages_per_s: float
    fewest_per_s: float
    """Of vehicle time, a vehicle on average and the one with the fewest."""
    references: float
    """CPU for a second of one vehicle over the CPU of the reference loop in the same run."""


def verdict(measured: Measured) -> tuple[int, str]:
    """Exit status, and why in a sentence. For the whole promise."""
    if not _is_enough(measured):
        rates = (
            f"{measured.messages_per_s:.1f} messages in a second of its time, one of them {measured.fewest_per_s:.1f}"
        )
        return BROKEN, f"broken: a vehicle sent {rates}"
    if measured.cpu_of_core > 1.0:
        return BROKEN, f"broken: the wanted speed takes {measured.cpu_of_core:.0%} of a core"
    if measured.factor < REAL_TIME:
        return NOT_MEASURED, f"not measured: others had the core, {measured.factor:.2f} of the wanted speed was reached"
    return KEPT, f"kept: {measured.factor:.2f} of the wanted speed with {measured.cpu_of_core:.0%} of a core"


def quick_verdict(measured: Measured) -> tuple[int, str]:
    """The same for machines that are slow or busy: against the reference loop, which is as slow there."""
    if not _is_enough(measured):
        return verdict(measured)
    said = f"a second of a vehicle takes {measured.references:.2f} of the reference loop, at most {MOST_REFERENCES:g}"
    if measured.references > MOST_REFERENCES:
        return BROKEN, f"broken: {said}"
    return KEPT, f"kept: {said}"


def _is_enough(measured: Measured) -> bool:
    return measured.messages_per_s >= MESSAGES_PER_S and measured.fewest_per_s >= FEWEST_PER_S
