"""The fence means the same everywhere on earth."""

from __future__ import annotations

import pytest

from app.domain.geo import LocalProjection
from app.domain.plan import parse_plan
from tests.support.rule_case import codes

PLACES = {"equator and antimeridian": (0.0, 180.0), "Fiji": (-17.0, -179.9999), "near a pole": (89.9995, 0.0)}


@pytest.mark.parametrize(("latitude_deg", "longitude_deg"), PLACES.values(), ids=PLACES)
@pytest.mark.parametrize(
    ("north_m", "east_m", "found"),
    [(90, 0, False), (0, 90, False), (-90, -90, False), (0, 110, True), (0, -110, True), (110, 0, True)],
)
def test_a_fence_of_200_m_around_home(
    latitude_deg: float, longitude_deg: float, north_m: float, east_m: float, found: bool
) -> None:
    around = LocalProjection(latitude_deg, longitude_deg)

    def at(north_m: float, east_m: float) -> dict[str, float]:
        latitude, longitude = around.to_global(east_m, north_m)
        return {"latitude_deg": latitude, "longitude_deg": longitude}

    plan = parse_plan(
        {
            "version": 1,
            "name": "anywhere",
            "vehicle_type": "multicopter",
            "home": {"latitude_deg": latitude_deg, "longitude_deg": longitude_deg, "absolute_altitude_m": 0},
            "geofence": {
                "polygons": [
                    {"kind": "inclusion", "vertices": [at(-100, -100), at(100, -100), at(100, 100), at(-100, 100)]}
                ]
            },
            "items": [
                {"type": "takeoff", "relative_altitude_m": 15},
                {"type": "waypoint", **at(north_m, east_m), "relative_altitude_m": 20},
                {"type": "return_to_launch"},
            ],
        }
    )
    assert ("geofence.leg_outside" in codes(plan)) is found
    assert "geofence.self_crossing" not in codes(plan)
    assert "geofence.home_outside" not in codes(plan)
    assert "geofence.antimeridian" in codes(plan), "the autopilot takes the long way around"


@pytest.mark.parametrize("half_deg", [0.1, 0.36, 0.7])
@pytest.mark.parametrize(("from_edge_m", "found"), [(3.0, True), (-3.0, False)])
def test_a_long_edge_is_straight_in_latitude_and_longitude(half_deg: float, from_edge_m: float, found: bool) -> None:
    edge_deg = 60.05
    corners = [(59.95, -half_deg), (edge_deg, -half_deg), (edge_deg, half_deg), (59.95, half_deg)]
    plan = parse_plan(
        {
            "version": 1,
            "name": "large",
            "vehicle_type": "multicopter",
            "home": {"latitude_deg": 60.0, "longitude_deg": 10.0, "absolute_altitude_m": 0},
            "geofence": {
                "polygons": [
                    {
                        "kind": "inclusion",
                        "vertices": [{"latitude_deg": north, "longitude_deg": 10.0 + east} for north, east in corners],
                    }
                ]
            },
            "items": [
                {"type": "takeoff", "relative_altitude_m": 15},
                {
                    "type": "waypoint",
                    "latitude_deg": edge_deg + from_edge_m / 111_195.0,
                    "longitude_deg": 10.0,
                    "relative_altitude_m": 20,
                },
                {"type": "return_to_launch"},
            ],
        }
    )
    assert ("geofence.leg_outside" in codes(plan)) is found
