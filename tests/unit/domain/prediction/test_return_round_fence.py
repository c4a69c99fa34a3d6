"""A return that firmware flies round the fence is predicted as long as that way is."""

from __future__ import annotations

import pytest

from app.domain.plan import Plan
from app.domain.prediction import predict
from app.domain.vehicle.state import VehicleProfile
from tests.support.plan_pieces import Json, facts, multicopter, square, waypoint

WALL: Json = {"polygons": [square("exclusion", 100, 0, 40)]}


def returns_s(plan: Plan, vehicle: VehicleProfile) -> tuple[float, float]:
    """Distance (m) and duration (s) of the return."""
    entry = predict(plan, vehicle).entries[-1]
    assert entry.type == "return_to_launch"
    return entry.distance_m, entry.duration_s


def quad(**more: Json) -> Plan:
    return multicopter(waypoint(100, 120), waypoint(200, 0), **more)


def test_newer_firmware_takes_longer_round_the_fence_than_straight() -> None:
    straight_m, straight_s = returns_s(quad(), facts(firmware=(1, 19, 0)))
    round_m, round_s = returns_s(quad(geofence=WALL), facts(firmware=(1, 19, 0)))
    assert round_m > straight_m + 20.0
    assert round_s > straight_s + (round_m - straight_m) / 12.0


@pytest.mark.parametrize("firmware", [(1, 18, 0), None])
def test_older_firmware_and_one_that_is_not_known_are_predicted_straight(firmware: tuple[int, int, int] | None) -> None:
    assert returns_s(quad(geofence=WALL), facts(firmware=firmware)) == returns_s(quad(), facts(firmware=firmware))


def test_a_fence_that_leaves_the_way_free_changes_nothing() -> None:
    aside = {"polygons": [square("exclusion", 100, -200, 40)]}
    known = facts(firmware=(1, 19, 0))
    assert returns_s(quad(geofence=aside), known) == returns_s(quad(), known)
