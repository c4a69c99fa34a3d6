"""The jerk-limited axis of a multicopter's trajectory: laws that hold from every state."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.simulator.dynamics.position_smoothing import VelocitySmoothing, synchronize

DT_S = 0.02
JERK, ACCELERATION, SPEED = 4.0, 3.0, 12.0

speeds = st.floats(-8.0, 8.0)
accelerations = st.floats(-ACCELERATION, ACCELERATION)


def axis(velocity: float = 0.0, acceleration: float = 0.0) -> VelocitySmoothing:
    made = VelocitySmoothing(JERK, ACCELERATION, SPEED)
    made.reset(0.0, velocity, acceleration)
    return made


def steps_to(smoothing: VelocitySmoothing, goal: float) -> int:
    """Cycles until `goal` is reached, replanned in each as in flight."""
    count = 0
    smoothing.plan(goal)
    while smoothing.duration_s > DT_S:
        smoothing.advance(DT_S)
        smoothing.plan(goal)
        count += 1
        assert count < 2000
    return count


@given(speeds, accelerations, speeds)
def test_a_plan_ends_at_the_wanted_speed_without_acceleration(start: float, acceleration: float, goal: float) -> None:
    smoothing = axis(start, acceleration)
    smoothing.plan(goal)
    smoothing.advance(smoothing.duration_s + DT_S)
    assert smoothing.velocity_m_s == pytest.approx(goal, abs=1e-3)
    assert smoothing.acceleration_m_s2 == pytest.approx(0.0, abs=1e-6)


@given(speeds, accelerations, speeds)
def test_acceleration_and_jerk_stay_within_their_limits(start: float, acceleration: float, goal: float) -> None:
    smoothing = axis(start, acceleration)
    smoothing.plan(goal)
    for _ in range(300):
        before = smoothing.acceleration_m_s2
        smoothing.advance(DT_S)
        smoothing.plan(goal)
        assert abs(smoothing.acceleration_m_s2) <= ACCELERATION + 1e-6
        assert abs(smoothing.acceleration_m_s2 - before) <= JERK * DT_S + 1e-6


@given(speeds, speeds)
def test_planning_anew_in_each_cycle_takes_no_longer(start: float, goal: float) -> None:
    once = axis(start)
    once.plan(goal)
    assert steps_to(axis(start), goal) * DT_S <= once.duration_s + DT_S


@given(speeds, speeds, speeds, speeds)
def test_synchronized_axes_reach_their_speeds_at_the_same_time(a: float, b: float, to_a: float, to_b: float) -> None:
    axes = (axis(a), axis(b))
    for smoothing, goal in zip(axes, (to_a, to_b), strict=True):
        smoothing.plan(goal)
    longest_s = max(smoothing.duration_s for smoothing in axes)
    synchronize(axes)
    for smoothing, goal, start in zip(axes, (to_a, to_b), (a, b), strict=True):
        if abs(goal - start) > 0.01:
            assert smoothing.duration_s == pytest.approx(longest_s, abs=0.01)
        smoothing.advance(longest_s)
        assert smoothing.velocity_m_s == pytest.approx(goal, abs=0.02)


def test_more_speed_than_the_limit_is_not_planned() -> None:
    smoothing = axis()
    smoothing.plan(50.0)
    smoothing.advance(60.0)
    assert smoothing.velocity_m_s == pytest.approx(SPEED)
