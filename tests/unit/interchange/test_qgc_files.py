"""Files made by hand after the documented format: they import, can be flown, and export equal in meaning."""

from __future__ import annotations

import json

import pytest

from app.domain.rules import check_plan
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import ConversionFinding, ConversionRefused, FindingKind
from app.interchange.formats import Conversion, SourceFormat, convert_to_plan
from app.interchange.qgc_writer import qgc_document
from tests.support.interchange_files import FOLDER, Json, document, meaning, raw
from tests.support.paths import PLANS

DELIVERIES = {
    "multicopter-delivery.plan": VehicleType.MULTICOPTER,
    "multicopter-patrol.plan": VehicleType.MULTICOPTER,
    "vtol-delivery.plan": VehicleType.VTOL,
    "fixed-wing-delivery.plan": VehicleType.FIXED_WING,
    "rover-delivery.plan": VehicleType.ROVER,
}
WITHOUT_LOSS = sorted(set(DELIVERIES) - {"vtol-delivery.plan"})


def converted(name: str) -> Conversion:
    return convert_to_plan(raw(name))


def places(findings: tuple[ConversionFinding, ...], kind: FindingKind) -> set[tuple[str, str]]:
    return {(finding.code.removeprefix("conversion."), finding.pointer) for finding in findings if finding.kind is kind}


def test_every_hand_made_file_is_used() -> None:
    tested = {*DELIVERIES, "survey.plan", "losses.plan", "mission-planner.waypoints"}
    assert {path.name for path in FOLDER.iterdir()} == tested


@pytest.mark.parametrize("name", sorted(DELIVERIES))
def test_a_file_becomes_a_plan_that_can_be_flown(name: str) -> None:
    conversion = converted(name)
    assert conversion.source is SourceFormat.QGC
    assert conversion.plan.vehicle_type is DELIVERIES[name]
    errors = [finding for finding in check_plan(conversion.plan, None) if finding.severity is Severity.ERROR]
    assert errors == []


@pytest.mark.parametrize("name", WITHOUT_LOSS)
def test_a_file_that_loses_nothing_exports_equal_in_meaning(name: str) -> None:
    conversion = converted(name)
    assert places(conversion.findings, FindingKind.LOST) == set()
    exported, _ = qgc_document(conversion.plan)
    assert meaning(exported) == meaning(document(name))


def test_what_a_file_loses_is_named_and_nothing_else_differs() -> None:
    conversion = converted("vtol-delivery.plan")
    at_landing = "/mission/items/8"
    assert places(conversion.findings, FindingKind.LOST) == {
        ("camera", f"{at_landing}/stopTakingPhotos"),
        ("camera", f"{at_landing}/stopVideoPhotos"),
        ("parameter", at_landing),
        ("land_start", at_landing),
    }
    exported, original = meaning(qgc_document(conversion.plan)[0]), meaning(document("vtol-delivery.plan"))
    landing = original["items"].index((189, "", (0.0,) * 7))
    assert original["items"].pop(landing)[0] == 189
    assert exported == original


def test_every_kind_of_loss_is_named_with_its_place() -> None:
    findings = converted("losses.plan").findings
    assert places(findings, FindingKind.LOST) == {
        ("unknown_field", "/weather"),
        ("planning_speed", "/mission/hoverSpeed"),
        ("camera", "/mission/items/1"),
        ("parameter", "/mission/items/2/params/2"),
        ("above_terrain", "/mission/items/3/AltitudeMode"),
        ("land_start", "/mission/items/5"),
        ("parameter", "/mission/items/6/params/0"),
        ("parameter", "/mission/items/6/params/1"),
    }
    assert places(findings, FindingKind.ASSUMED) == {
        ("instance", "/mission/items/4/params/0"),
        ("release_motion", "/mission/items/4"),
        ("braking", "/mission/items/3"),
    }
    assert all(finding.message for finding in findings)


def test_a_survey_is_refused_by_its_name() -> None:
    with pytest.raises(ConversionRefused) as refused:
        converted("survey.plan")
    (finding,) = refused.value.findings
    assert finding.pointer == "/mission/items/1/complexItemType"
    assert "'survey'" in finding.message


def test_a_drop_is_an_item_of_the_mission_and_what_is_not_said_of_it_is_assumed() -> None:
    plan = converted("multicopter-delivery.plan").plan
    drop = next(item for item in plan.items if item.type == "gripper")
    assert (drop.action, drop.mode, drop.release_motion, drop.instance) == ("release", "embedded", "stopped", 1)
    rover_drop = next(item for item in converted("rover-delivery.plan").plan.items if item.type == "gripper")
    assert (rover_drop.release_motion, rover_drop.instance) == ("stopped", 2)
    wing_drop = next(item for item in converted("fixed-wing-delivery.plan").plan.items if item.type == "gripper")
    assert wing_drop.release_motion == "moving"


def test_the_landing_of_a_fixed_wing_is_one_item_with_its_approach() -> None:
    land = converted("fixed-wing-delivery.plan").plan.items[-1]
    assert land.type == "land"
    assert land.approach is not None
    assert (land.approach.latitude_deg, land.approach.longitude_deg) == (47.4006, 8.548)
    assert (land.approach.relative_altitude_m, land.approach.radius_m) == (20.0, 60.0)


def test_a_photo_before_the_landing_leaves_the_loiter_before_it_in_the_plan() -> None:
    file = document("fixed-wing-delivery.plan")
    loiter, land = [1, 60, 0, 1, 47.4006, 8.548, 20], [0, 0, 0, None, 47.3977, 8.5456, 0]
    picture = [0, 0, 1, None, None, None, None]
    file["mission"]["items"][5:] = [simple(31, loiter, 3), simple(2000, picture, 2), simple(21, land, 3)]
    conversion = convert_to_plan(json.dumps(file).encode())
    assert [item.type for item in conversion.plan.items[-3:]] == ["loiter", "photo", "land"]
    assert "land_start" not in {code for code, _ in places(conversion.findings, FindingKind.LOST)}


def simple(command: int, params: list[float | None], frame: int) -> Json:
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": params}


def test_a_plan_with_a_byte_order_mark_is_taken_as_it_is() -> None:
    plan = (PLANS / "clinic-run.json").read_bytes()
    assert convert_to_plan(b"\xef\xbb\xbf" + plan).plan == convert_to_plan(plan).plan


def test_a_jump_goes_to_the_item_with_that_number() -> None:
    plan = converted("multicopter-patrol.plan").plan
    jump = next(item for item in plan.items if item.type == "jump")
    assert (jump.target, jump.repeats) == (plan.items[2].id, 2)


def test_fence_rally_points_and_home_are_carried() -> None:
    plan = converted("multicopter-delivery.plan").plan
    assert [(polygon.kind, len(polygon.vertices)) for polygon in plan.geofence.polygons] == [("inclusion", 4)]
    assert [(circle.kind, circle.radius_m) for circle in plan.geofence.circles] == [("exclusion", 20.0)]
    assert [point.relative_altitude_m for point in plan.rally_points] == [20.0, 25.5]
    assert plan.home is not None
    assert plan.home.absolute_altitude_m == 488.0


def test_a_file_for_ardupilot_is_read_as_px4_flies_it_and_its_zero_yaws_are_open() -> None:
    made = document("multicopter-delivery.plan")
    made["mission"]["firmwareType"] = 3
    made["mission"]["items"][1]["params"][3] = 0
    conversion = convert_to_plan(json.dumps(made).encode())
    assert places(conversion.findings, FindingKind.ASSUMED) >= {
        ("firmware", "/mission/firmwareType"),
        ("yaw", "/mission/firmwareType"),
    }
    assert conversion.plan.items[1].yaw_deg is None  # type: ignore[union-attr]
