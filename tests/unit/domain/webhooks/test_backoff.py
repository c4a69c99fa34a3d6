"""The law of waiting: longer each time, never without end, never in step."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from app.domain.webhooks.webhook import Backoff

chances = st.floats(0.0, 1.0, exclude_max=True)
failures = st.integers(1, 10**9)
laws = st.builds(Backoff, first_s=st.floats(0.1, 60.0), longest_s=st.floats(60.0, 1e6))


@given(laws, failures, chances, st.none() | st.floats(0.0, 1e12))
def test_a_wait_is_between_half_the_first_step_and_the_longest(
    law: Backoff, number: int, chance: float, asked_s: float | None
) -> None:
    assert law.first_s / 2 <= law.wait_s(number, chance=chance, asked_s=asked_s) <= law.longest_s


@given(laws, failures, chances)
def test_more_failures_never_wait_shorter(law: Backoff, number: int, chance: float) -> None:
    assert law.wait_s(number, chance=chance) <= law.wait_s(number + 1, chance=chance)


@given(failures, chances, st.floats(0.0, 3600.0))
def test_a_receiver_that_asks_for_time_is_not_asked_before(number: int, chance: float, asked_s: float) -> None:
    assert Backoff().wait_s(number, chance=chance, asked_s=asked_s) >= asked_s


def test_the_usual_waits_are_those_of_the_docs() -> None:
    steps = [Backoff().wait_s(number, chance=0.0) * 2 for number in range(1, 14)]
    assert steps == [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 3600, 3600]
