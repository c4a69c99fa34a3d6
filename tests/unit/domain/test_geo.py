"""Metres on the ground, also at the antimeridian and the poles."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.geo import LocalProjection, bearing_deg, destination_deg, distance_m, wrap_longitude_deg

LATITUDES = st.floats(-90, 90)
LONGITUDES = st.floats(-180, 180)


def test_a_degree_of_latitude_is_111_km() -> None:
    assert distance_m(47, 8, 48, 8) == pytest.approx(111_194.9, abs=0.1)


def test_the_antimeridian_is_no_border() -> None:
    assert distance_m(0, 179.9995, 0, -179.9995) == pytest.approx(111.2, abs=0.1)
    assert bearing_deg(0, 179.9995, 0, -179.9995) == pytest.approx(90)
    assert LocalProjection(0, 179.9995).to_local(0, -179.9995) == pytest.approx((111.2, 0), abs=0.1)
    assert destination_deg(0, 179.9995, 90, 111.19)[1] == pytest.approx(-179.9995, abs=1e-6)


def test_longitudes_are_wrapped() -> None:
    assert [wrap_longitude_deg(value) for value in (181, -181, 360, 8)] == [-179, 179, 0, 8]


@given(LATITUDES, LONGITUDES, st.floats(0, 360), st.floats(0, 100_000))
def test_a_destination_is_as_far_away_as_asked(lat: float, lon: float, bearing: float, away_m: float) -> None:
    assert distance_m(lat, lon, *destination_deg(lat, lon, bearing, away_m)) == pytest.approx(away_m, abs=0.2)


@given(st.floats(-89.9, 89.9), LONGITUDES, st.floats(-20_000, 20_000), st.floats(-20_000, 20_000))
def test_the_projection_goes_both_ways(lat: float, lon: float, east_m: float, north_m: float) -> None:
    projection = LocalProjection(lat, lon)
    back = projection.to_local(*projection.to_global(east_m, north_m))
    assert back == pytest.approx((east_m, north_m), abs=0.5)


@given(LATITUDES, LONGITUDES, LATITUDES, LONGITUDES)
def test_distances_are_the_same_both_ways(a_lat: float, a_lon: float, b_lat: float, b_lon: float) -> None:
    there = distance_m(a_lat, a_lon, b_lat, b_lon)
    assert there == pytest.approx(distance_m(b_lat, b_lon, a_lat, a_lon))
    assert 0 <= there <= 20_015_087
