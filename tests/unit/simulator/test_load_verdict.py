"""What the load bench calls kept, broken and not measured."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bench.simulator_assessment import BROKEN, KEPT, NOT_MEASURED, Measured, quick_verdict, verdict

GOOD = Measured(factor=1.0, cpu_of_core=0.4, messages_per_s=10.0, fewest_per_s=9.6, references=1.5)


@pytest.mark.parametrize(
    ("change", "status", "quick"),
    [
        ({}, KEPT, KEPT),
        ({"factor": 0.9}, NOT_MEASURED, KEPT),
        ({"factor": 0.9, "cpu_of_core": 1.1}, BROKEN, KEPT),  # a slow machine: the reference loop is slow there, too
        ({"messages_per_s": 9.0}, BROKEN, BROKEN),
        ({"fewest_per_s": 7.0}, BROKEN, BROKEN),
        ({"references": 6.0}, KEPT, BROKEN),
    ],
)
def test_the_promise_is_judged_by_cpu_vehicle_time_and_messages(
    change: dict[str, float], status: int, quick: int
) -> None:
    measured = replace(GOOD, **change)
    assert (verdict(measured)[0], quick_verdict(measured)[0]) == (status, quick)
