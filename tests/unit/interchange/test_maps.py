"""Plans on maps: GeoJSON by RFC 7946, KML 2.2."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree as Xml

import pytest
from hypothesis import HealthCheck, given, settings

from app.domain.plan import Plan
from app.interchange.findings import ConversionFinding, FindingKind
from app.interchange.formats import TargetFormat, file_name
from app.interchange.geojson_writer import geojson_text
from app.interchange.kml_writer import kml_text
from tests.support.plan_pieces import HOME, at, circle, delay, gripper, multicopter, square, waypoint
from tests.support.plan_strategies import PLANS

KML = "{http://www.opengis.net/kml/2.2}"
SLOW_DATA = settings(suppress_health_check=[HealthCheck.too_slow], deadline=None, max_examples=60)
PLAN = multicopter(
    waypoint(100, 0, id="door"),
    gripper(id="drop", alternate=at(100, 40, relative_altitude_m=25, id="locker")),
    delay(3),
    order={"id": "RX-1"},
    geofence={"polygons": [square("inclusion", 0, 0, 300)], "circles": [circle("exclusion", 100, 100, 30)]},
    rally_points=[{**at(50, 0), "relative_altitude_m": 20}],
)
NEAR_THE_DATE_LINE = multicopter(
    {"type": "waypoint", "latitude_deg": 10.0, "longitude_deg": 179.999, "relative_altitude_m": 20},
    {"type": "waypoint", "latitude_deg": 10.0, "longitude_deg": -179.999, "relative_altitude_m": 20},
    home={"latitude_deg": 10.0, "longitude_deg": 179.998, "absolute_altitude_m": 0},
    geofence={"circles": [{"kind": "inclusion", "latitude_deg": 10.0, "longitude_deg": 180.0, "radius_m": 900}]},
)
AT_THE_POLE = multicopter(
    geofence={"circles": [{"kind": "inclusion", "latitude_deg": 89.999, "longitude_deg": 0.0, "radius_m": 900}]}
)


def features(plan: Plan, role: str) -> list[Any]:
    document = json.loads(geojson_text(plan)[0])
    assert document["type"] == "FeatureCollection"
    return [feature for feature in document["features"] if feature["properties"]["role"] == role]


def geometries(plan: Plan) -> list[Any]:
    return [
        feature["geometry"]
        for feature in json.loads(geojson_text(plan)[0])["features"]
        if feature["geometry"] is not None
    ]


def positions(coordinates: Any) -> list[list[float]]:
    if isinstance(coordinates[0], (int, float)):
        return [coordinates]
    return [place for part in coordinates for place in positions(part)]


def is_counter_clockwise(ring: list[list[float]]) -> bool:
    return sum((there[0] - here[0]) * (there[1] + here[1]) for here, there in pairwise(ring)) < 0


def test_geojson_has_every_item_in_order_also_those_without_a_place() -> None:
    items = [feature["properties"] for feature in features(PLAN, "item")]
    assert [item["order"] for item in items] == [1, 2, 3, 4, 5]
    assert [item["type"] for item in items] == ["takeoff", "waypoint", "gripper", "delay", "return_to_launch"]
    assert [feature["geometry"] is None for feature in features(PLAN, "item")] == [True, False, True, True, True]


def test_geojson_has_legs_drops_releases_fence_rally_points_and_home() -> None:
    assert [leg["properties"]["to"] for leg in features(PLAN, "leg")] == ["door", "item-5"]
    (drop,) = features(PLAN, "drop")
    place = PLAN.items[1]
    assert place.type == "waypoint"
    assert drop["geometry"]["coordinates"] == [place.longitude_deg, place.latitude_deg]
    assert drop["properties"]["supervised"] is True
    (alternate,) = features(PLAN, "alternate")
    there = PLAN.alternates[0][1]
    assert alternate["geometry"]["coordinates"] == [there.longitude_deg, there.latitude_deg]
    assert (alternate["properties"]["item_id"], alternate["properties"]["drop"]) == ("locker", "drop")
    (release,) = features(PLAN, "predicted_release")
    assert release["properties"]["offset_m"] > 0
    assert [fence["properties"]["fence"] for fence in features(PLAN, "fence")] == ["inclusion", "exclusion"]
    assert len(features(PLAN, "rally_point")) == 1
    assert features(PLAN, "home")[0]["geometry"]["coordinates"] == [HOME.longitude_deg, HOME.latitude_deg]
    assert json.loads(geojson_text(PLAN)[0])["waydrop"]["order"] == {"id": "RX-1"}


def test_geojson_is_cut_at_the_antimeridian() -> None:
    legs = [leg["geometry"] for leg in features(NEAR_THE_DATE_LINE, "leg")]
    assert [leg["type"] for leg in legs] == ["LineString", "MultiLineString", "MultiLineString"]
    east, west = legs[1]["coordinates"]
    assert {east[-1][0], west[0][0]} == {180.0, -180.0}
    (fence,) = features(NEAR_THE_DATE_LINE, "fence")
    assert fence["geometry"]["type"] == "MultiPolygon"
    assert len(fence["geometry"]["coordinates"]) == 2


@pytest.mark.parametrize("write", [geojson_text, kml_text])
def test_a_circle_around_a_pole_is_lost_aloud(write: Any) -> None:
    findings: tuple[ConversionFinding, ...] = write(AT_THE_POLE)[1]
    assert [(finding.kind, finding.code, finding.pointer) for finding in findings] == [
        (FindingKind.LOST, "conversion.polar_circle", "/geofence/circles/0")
    ]


@SLOW_DATA
@given(PLANS)
def test_any_plan_is_geojson_within_the_world_with_closed_rings(plan: Plan) -> None:
    for geometry in geometries(plan):
        for longitude, latitude in positions(geometry["coordinates"]):
            assert -180 <= longitude <= 180
            assert -90 <= latitude <= 90
        polygons = [geometry["coordinates"]] if geometry["type"] == "Polygon" else []
        polygons += geometry["coordinates"] if geometry["type"] == "MultiPolygon" else []
        for rings in polygons:
            assert all(len(ring) >= 4 and ring[0] == ring[-1] for ring in rings)


def test_the_rings_of_geojson_turn_counter_clockwise() -> None:
    for fence in features(PLAN, "fence"):
        assert is_counter_clockwise(fence["geometry"]["coordinates"][0])


def folders(plan: Plan) -> dict[str, Xml.Element]:
    root = Xml.fromstring(kml_text(plan)[0].partition("\n")[2])
    return {str(folder.findtext(f"{KML}name")): folder for folder in root.iter(f"{KML}Folder")}


def names(folder: Xml.Element) -> list[str | None]:
    return [mark.findtext(f"{KML}name") for mark in folder.iter(f"{KML}Placemark")]


def test_kml_has_items_in_order_route_drops_fence_and_rally_points() -> None:
    found = folders(PLAN)
    assert names(found["Items"]) == ["1 item-1", "2 door", "3 drop", "4 item-4", "5 item-5"]
    assert names(found["Predicted route"]) == ["to item-1", "to door", "to item-5"]
    assert names(found["Drops"]) == ["drop", "locker"]
    assert names(found["Geofence"]) == ["inclusion 1", "exclusion circle 1"]
    assert names(found["Rally points"]) == ["rally point 1"]


def test_kml_altitudes_are_above_the_sea_if_home_is_known_else_above_the_ground() -> None:
    drop = folders(PLAN)["Drops"].find(f".//{KML}Point")
    assert drop is not None
    assert drop.findtext(f"{KML}altitudeMode") == "absolute"
    assert str(drop.findtext(f"{KML}coordinates")).split(",")[2] == "518.0"
    homeless = multicopter(waypoint(100, 0), gripper(), home=None)
    drop = folders(homeless)["Drops"].find(f".//{KML}Point")
    assert drop is not None
    assert drop.findtext(f"{KML}altitudeMode") == "relativeToGround"
    assert str(drop.findtext(f"{KML}coordinates")).split(",")[2] == "30.0"
    assert [(finding.kind, finding.code) for finding in kml_text(homeless)[1]] == [
        (FindingKind.ASSUMED, "conversion.home")
    ]


def test_kml_takes_names_that_are_no_xml() -> None:
    plan = PLAN.model_copy(update={"name": "a <b> & \x00 \x1b\ufffe c"})
    root = Xml.fromstring(kml_text(plan)[0].partition("\n")[2])
    assert root.findtext(f"{KML}Document/{KML}name") == "a <b> & \ufffd \ufffd\ufffd c"


@SLOW_DATA
@given(PLANS)
def test_any_plan_is_kml_with_every_item(plan: Plan) -> None:
    assert len(names(folders(plan)["Items"])) == len(plan.items)


@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("Clinic run", "clinic-run.plan"),
        ('a/b\\c"\r\nX-Evil: 1', "a-b-c-x-evil-1.plan"),
        ("Überlingen", "berlingen.plan"),
        ("薬", "plan.plan"),
        ("..", "plan.plan"),
        ("x" * 200, "x" * 80 + ".plan"),
    ],
)
def test_a_file_is_called_what_every_header_and_file_system_takes(name: str, file: str) -> None:
    assert file_name(name, TargetFormat.QGC) == file
