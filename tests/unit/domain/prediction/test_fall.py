"""The fall of a parcel: between no drag and no speed of its own."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.prediction.motion import Wind
from app.domain.prediction.release import GRAVITY_M_S2, TERMINAL_M_S, fall

HEIGHTS = st.floats(0.5, 500.0)
SPEEDS = st.floats(0.0, 40.0)


@given(HEIGHTS, SPEEDS)
def test_drag_makes_a_fall_longer_and_a_throw_shorter(height_m: float, speed_m_s: float) -> None:
    free_s = math.sqrt(2.0 * height_m / GRAVITY_M_S2)
    falls = fall(height_m, (speed_m_s, 0.0))
    assert free_s * 0.999 <= falls.duration_s <= free_s + height_m / TERMINAL_M_S + speed_m_s / GRAVITY_M_S2
    assert falls.throw_m <= speed_m_s * falls.duration_s + 1e-6


@given(HEIGHTS, SPEEDS)
def test_without_drag_it_is_the_parabola_of_the_textbooks(height_m: float, speed_m_s: float) -> None:
    free_s = math.sqrt(2.0 * height_m / GRAVITY_M_S2)
    falls = fall(height_m, (0.0, speed_m_s), terminal_m_s=1e6)
    assert falls.duration_s == pytest.approx(free_s, rel=0.02, abs=0.01)
    assert falls.throw_m == pytest.approx(speed_m_s * free_s, rel=0.02, abs=0.5)


@given(HEIGHTS, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
def test_the_wind_carries_it_its_own_way_and_never_farther_than_the_air(
    height_m: float, north_m_s: float, east_m_s: float
) -> None:
    falls = fall(height_m, (0.0, 0.0), Wind(north_m_s, east_m_s))
    east_m, north_m = falls.moved
    assert east_m * east_m_s >= -1e-9
    assert north_m * north_m_s >= -1e-9
    assert falls.throw_m <= math.hypot(north_m_s, east_m_s) * falls.duration_s + 1e-6


@given(HEIGHTS, SPEEDS, st.floats(-20.0, 20.0))
def test_only_the_speed_through_the_air_counts(height_m: float, speed_m_s: float, wind_m_s: float) -> None:
    """Seen from the air a fall in wind is one in calm air."""
    there, calm = fall(height_m, (speed_m_s + wind_m_s, 0.0), Wind(0.0, wind_m_s)), fall(height_m, (speed_m_s, 0.0))
    assert there.duration_s == pytest.approx(calm.duration_s, rel=1e-6)
    assert there.moved[0] - wind_m_s * there.duration_s == pytest.approx(calm.moved[0], abs=1e-3)


def test_on_the_ground_nothing_falls() -> None:
    assert fall(0.0, (5.0, 5.0)).throw_m == 0.0
