"""The pace: a grid of due times without bursts, a gap that is noticed, and the figures told of it."""

from __future__ import annotations

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.services.offboard.rate_loop import RateClock, next_due_s
from app.services.offboard.stream import KEPT, RateStatistics


@settings(deadline=None)
@given(due=st.floats(0, 1e6), late=st.floats(0, 100), period=st.sampled_from([0.02, 0.05]))
def test_the_next_due_time_is_on_the_grid_and_ahead(due: float, late: float, period: float) -> None:
    found = next_due_s(due, due + late, period)
    assert due + late - 1e-6 <= found <= due + late + period + 1e-6
    steps = (found - due) / period
    assert steps == pytest.approx(round(steps), abs=1e-3)


async def test_it_ticks_until_it_is_cancelled() -> None:
    ticks: list[float] = []
    rate_clock = RateClock(0.01, 60.0, ticks.append, lambda gap_s: None)
    task = asyncio.create_task(rate_clock.run())
    async with asyncio.timeout(10):
        while len(ticks) < 5:
            await asyncio.sleep(0.005)
    task.cancel()
    assert ticks == sorted(ticks)


async def test_a_suspend_that_the_monotonic_clock_does_not_see_is_a_gap() -> None:
    ticks: list[float] = []
    gaps: list[float] = []
    uptime = iter([0.0, 0.0, 0.0, 0.0, 3600.0, 3600.0])
    rate_clock = RateClock(0.001, 0.5, ticks.append, gaps.append, uptime=lambda: next(uptime))
    async with asyncio.timeout(10):
        await rate_clock.run()
    assert gaps == [3600.0]
    assert len(ticks) == 1, "after the gap nothing is ticked"


def test_whoever_comes_before_the_tick_notices_the_gap_and_it_is_told_once() -> None:
    gaps: list[float] = []
    now = [0.0]
    rate_clock = RateClock(0.05, 0.5, lambda now_s: None, gaps.append, uptime=lambda: now[0])
    assert not rate_clock.check_gap()
    now[0] = 2.0
    assert rate_clock.check_gap()
    assert not rate_clock.check_gap()
    assert gaps == [2.0]


def test_the_cadence_tells_rate_and_intervals_of_the_last_sends() -> None:
    rate = RateStatistics(20.0)
    assert rate.view().achieved_hz is None
    for number in range(KEPT + 50):
        rate.sent(number * 0.05)
    rate.sent((KEPT + 50) * 0.05 + 0.1)
    view = rate.view()
    assert view.p50_ms == 50.0
    assert view.max_ms == 150.0
    assert view.achieved_hz == pytest.approx(20.0, rel=0.02)
    assert rate.sends == KEPT + 51
