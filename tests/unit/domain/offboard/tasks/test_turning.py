"""What makes up for the lag in a turn: bounded, continuous, and learnt from circles alone."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.offboard.tasks.course import CircleCourse, Course, Ground, LegsCourse, PointCourse
from app.domain.offboard.tasks.guidance import (
    BACK_PER_S,
    LEARNS_WITHIN_M,
    LEARNT_PER_S2,
    LONGEST_LAG_S,
    LONGEST_STEP_S,
    SHORTEST_LAG_S,
    inwards_m_s,
    learnt_lag_s,
)

lags = st.floats(-10.0, 10.0)
speeds = st.floats(0.5, 20.0)
radii = st.floats(1.0, 1000.0)
CIRCLE = CircleCourse((30.0, 0.0), -20.0)


@given(lag_s=lags, speed=speeds, radius_m=radii)
def test_it_is_bounded_by_the_centripetal_acceleration_and_by_half_the_speed(
    lag_s: float, speed: float, radius_m: float
) -> None:
    centripetal = speed**2 / radius_m
    inwards = inwards_m_s(lag_s, speed, radius_m)
    assert SHORTEST_LAG_S * centripetal - 1e-9 <= inwards <= LONGEST_LAG_S * centripetal + 1e-9
    assert abs(inwards) <= speed / 2.0
    assert inwards_m_s(0.0, speed, radius_m) == 0.0


@given(
    lag_s=lags,
    outside_m=st.floats(-15.0, 50.0),
    velocity=st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0)),
    speed=speeds,
    seconds=st.floats(0.0, 2.0),
)
def test_what_is_learnt_in_a_tick_is_bounded(
    lag_s: float, outside_m: float, velocity: Ground, speed: float, seconds: float
) -> None:
    known_s = max(SHORTEST_LAG_S, min(LONGEST_LAG_S, lag_s))
    learnt_s = learnt_lag_s(known_s, CIRCLE, (30.0, 20.0 + outside_m), velocity, speed, seconds)
    assert SHORTEST_LAG_S <= learnt_s <= LONGEST_LAG_S
    changed = inwards_m_s(learnt_s, speed, 20.0) - inwards_m_s(known_s, speed, 20.0)
    assert abs(changed) <= LEARNT_PER_S2 * LEARNS_WITHIN_M * LONGEST_STEP_S + 1e-9, "no jump, also after a late tick"


@pytest.mark.parametrize(("outside_m", "way"), [(1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)])
def test_what_stays_outside_has_a_longer_lag_and_what_stays_inside_a_shorter_one(outside_m: float, way: float) -> None:
    """Along the circle, neither out nor in."""
    changed = learnt_lag_s(0.3, CIRCLE, (30.0, 20.0 + outside_m), (5.0, 0.0), 5.0, 0.1) - 0.3
    assert changed == pytest.approx(way * LEARNT_PER_S2 * 0.1 * 20.0 / 5.0**2)


def test_what_comes_back_as_asked_learns_nothing() -> None:
    back = -BACK_PER_S * 2.0
    assert learnt_lag_s(0.3, CIRCLE, (30.0, 22.0), (4.0, back), 5.0, 0.1) == pytest.approx(0.3)


def test_what_still_joins_the_circle_learns_nothing() -> None:
    assert learnt_lag_s(0.3, CIRCLE, (30.0, 20.0 + LEARNS_WITHIN_M + 0.1), (0.0, 0.0), 5.0, 0.1) == 0.3


@pytest.mark.parametrize("course", [PointCourse((0.0, 0.0)), LegsCourse(((0.0, 0.0), (10.0, 0.0)))])
def test_what_does_not_turn_has_no_lag(course: Course) -> None:
    assert learnt_lag_s(0.8, course, (1.0, 1.0), (0.0, 0.0), 5.0, 0.1) == 0.0
