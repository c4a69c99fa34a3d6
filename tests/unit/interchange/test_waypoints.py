"""Waypoint files of Mission Planner: line 0 is the home position, and what the text cannot say is assumed aloud."""

from __future__ import annotations

import pytest

from app.domain.rules import check_plan
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import VehicleType
from app.interchange.findings import ConversionRefused
from app.interchange.formats import Conversion, SourceFormat, convert_to_plan
from tests.support.interchange_files import raw

HOME = "0 1 0 16 0 0 0 0 47.397742 8.545594 488 1"
TAKEOFF = "1 0 3 22 0 0 0 0 0 0 20 1"
RETURN = "2 0 3 20 0 0 0 0 0 0 0 1"


def text(*lines: str, version: int = 110) -> bytes:
    return "\n".join([f"QGC WPL {version}", *lines]).encode()


def converted(*lines: str, version: int = 110) -> Conversion:
    return convert_to_plan(text(*lines, version=version))


def codes(conversion: Conversion) -> set[str]:
    return {finding.code.removeprefix("conversion.") for finding in conversion.findings}


def test_a_file_as_mission_planner_saves_it_becomes_a_plan_that_can_be_flown() -> None:
    conversion = convert_to_plan(raw("mission-planner.waypoints"), name="From the field")
    assert conversion.source is SourceFormat.WAYPOINTS
    plan = conversion.plan
    assert (plan.name, plan.vehicle_type) == ("From the field", VehicleType.MULTICOPTER)
    assert [item.type for item in plan.items] == ["takeoff", "waypoint", "gripper", "delay", "return_to_launch"]
    assert not [finding for finding in check_plan(plan, None) if finding.severity is Severity.ERROR]
    assert codes(conversion) == {"vehicle_type", "yaw", "release_motion"}


def test_line_0_is_home_and_no_item() -> None:
    plan = converted(HOME, TAKEOFF, RETURN).plan
    assert plan.home is not None
    assert (plan.home.latitude_deg, plan.home.longitude_deg) == (47.397742, 8.545594)
    assert plan.home.absolute_altitude_m == 488
    assert [item.type for item in plan.items] == ["takeoff", "return_to_launch"]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_end_as_editors_count_them(end: str) -> None:
    lines = text(HOME, TAKEOFF, RETURN).decode().split("\n")
    assert len(convert_to_plan((end.join(lines) + end).encode()).plan.items) == 2


@pytest.mark.parametrize("other", ["\u2028", "\x85", "\x0b", "\x0c", "\x1c"])
def test_nothing_else_ends_a_line(other: str) -> None:
    with pytest.raises(ConversionRefused) as refused:
        converted(HOME, TAKEOFF + other + RETURN)
    assert [(finding.code, finding.pointer) for finding in refused.value.findings] == [("conversion.columns", "/3")]


def test_a_takeoff_at_0_0_is_above_home() -> None:
    takeoff = converted(HOME, TAKEOFF, RETURN).plan.items[0]
    assert takeoff.type == "takeoff"
    assert (takeoff.latitude_deg, takeoff.relative_altitude_m) == (None, 20.0)


def test_comments_and_blank_lines_count_for_nothing_and_comments_are_lost_aloud() -> None:
    conversion = converted("# from the runway", HOME, "", TAKEOFF, "   ", "  # and back", RETURN, "#")
    assert conversion.plan == converted(HOME, TAKEOFF, RETURN).plan
    (lost,) = (finding for finding in conversion.findings if finding.code == "conversion.comment")
    assert (lost.kind, lost.pointer) == ("lost", "/2")
    assert lost.message.endswith("this one and 2 more are omitted")


def test_a_jump_that_is_never_followed_is_no_item() -> None:
    point = "2 0 3 16 0 0 0 0 47.398192 8.545594 20 1"
    conversion = converted(HOME, TAKEOFF, point, "3 0 0 177 2 0 0 0 0 0 0 1", "4 0 3 20 0 0 0 0 0 0 0 1")
    assert [item.type for item in conversion.plan.items] == ["takeoff", "waypoint", "return_to_launch"]
    assert "no_change" in codes(conversion)


def test_version_120_has_no_home() -> None:
    conversion = converted("0 1 3 22 0 0 0 0 0 0 20 1", "1 0 3 20 0 0 0 0 0 0 0 1", version=120)
    assert conversion.plan.home is None
    assert [item.type for item in conversion.plan.items] == ["takeoff", "return_to_launch"]


def test_a_first_line_that_is_no_home_is_an_item_and_that_is_said() -> None:
    conversion = converted("0 1 3 22 0 0 0 0 0 0 20 1", "1 0 3 20 0 0 0 0 0 0 0 1")
    assert [item.type for item in conversion.plan.items] == ["takeoff", "return_to_launch"]
    assert "home" in codes(conversion)


def test_a_home_that_is_not_given_is_lost_aloud() -> None:
    conversion = converted("0 1 0 16 0 0 0 0 0 0 0 1", TAKEOFF, RETURN)
    assert conversion.plan.home is None
    assert "home" in codes(conversion)


def test_a_jump_goes_to_the_line_with_that_index() -> None:
    point = "2 0 3 16 0 0 0 0 47.398192 8.545594 20 1"
    plan = converted(HOME, TAKEOFF, point, "3 0 3 177 2 3 0 0 0 0 0 1", "4 0 3 20 0 0 0 0 0 0 0 1").plan
    jump = plan.items[2]
    assert jump.type == "jump"
    assert (jump.target, jump.repeats) == (plan.items[1].id, 3)


def test_vtol_commands_make_it_a_vtol_and_a_caller_may_say_another_type() -> None:
    lines = (HOME, "1 0 3 84 0 0 0 0 47.399 8.545594 30 1", "2 0 3 85 0 0 0 0 47.397742 8.545594 0 1")
    assert converted(*lines).plan.vehicle_type is VehicleType.VTOL
    rover = convert_to_plan(text(HOME, "1 0 3 16 0 0 0 0 47.399 8.545 0 1"), vehicle_type=VehicleType.ROVER)
    assert rover.plan.vehicle_type is VehicleType.ROVER
    assert "vehicle_type" not in codes(rover)


@pytest.mark.parametrize(
    ("line", "code", "pointer"),
    [
        ("1 0 3 22 0 0 0 0 0 0 20", "conversion.columns", "/3"),
        ("2 0 3 22 0 0 0 0 0 0 20 1", "conversion.order", "/3/index"),
        ("1 0 3 22 0 0 0 0 0 0 20 0", "conversion.auto_continue", "/3/autocontinue"),
        ("1 0 x 22 0 0 0 0 0 0 20 1", "conversion.wrong_type", "/3/frame"),
        ("1 0 3 22 1_0 0 0 0 0 0 20 1", "conversion.wrong_type", "/3/param1"),
        ("1 0 3 22 inf 0 0 0 0 0 20 1", "conversion.wrong_type", "/3/param1"),
        ("1 0 3 22 0 0 0 0 0 0 1e999 1", "conversion.wrong_type", "/3/altitude"),
        ("1 0 3 22 0 0 0 0 0 0 nan 1", "conversion.missing", "/3/altitude"),
        ("1 0 3 16 0 0 0 0 0 0 20 1", "conversion.missing", "/3/latitude"),
        ("1 0 3 19 20 0 0 0 0 0 20 1", "conversion.missing", "/3/latitude"),
        ("1 0 3 31 0 60 0 0 0 0 20 1", "conversion.missing", "/3/latitude"),
        ("1 0 3 16 0 0 0 0 47 200 20 1", "plan.out_of_range", "/3/longitude"),
        ("1 0 10 16 0 0 0 0 47 8 20 1", "conversion.frame", "/3"),
        ("1 0 3 82 0 0 0 0 47 8 20 1", "conversion.command", "/3"),
    ],
)
def test_a_line_that_cannot_be_used_is_refused_at_its_place(line: str, code: str, pointer: str) -> None:
    with pytest.raises(ConversionRefused) as refused:
        converted(HOME, line, RETURN)
    assert (code, pointer) in {(finding.code, finding.pointer) for finding in refused.value.findings}
