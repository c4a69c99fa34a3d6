"""For each feasibility check of the autopilot: a plan that it would reject, and that Waydrop rejects before for it."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.rules import check_plan
from app.domain.validation.finding import Severity
from app.domain.vehicle.state import InFlight, VehicleType
from app.simulator.firmware import PX4_1_13, PX4_1_14, PX4_MAIN, FirmwareProfile
from app.simulator.mission import feasibility
from app.simulator.params import Value
from tests.contract.feasibility.autopilot import facts_of, refusals
from tests.support.plan_pieces import (
    RETURN,
    at,
    circle,
    fixed_wing,
    land,
    multicopter,
    plan,
    square,
    takeoff,
    vtol,
    waypoint,
    wing_takeoff,
)

STEEP = {**at(130, 0), "relative_altitude_m": 60, "radius_m": 0}
INSIDE = {**at(30, 0), "relative_altitude_m": 20, "radius_m": 80}
BELOW = {**at(300, 0), "relative_altitude_m": 0, "radius_m": 60}
FAR = waypoint(600, 0)

Row = tuple[str, str, Plan, Mapping[str, Value]]
ROWS: list[Row] = [
    ("navigator_mis_unsup_cmd", "vtol.items_only_on_vtol", multicopter({"type": "transition", "to": "fixed_wing"}), {}),
    ("navigator_mis_starts_w_landing", "landing.first", plan("multicopter", land(50), waypoint(), RETURN), {}),
    ("navigator_mis_starts_w_landing2", "landing.first", plan("vtol", land(50), waypoint(300), land()), {}),
    ("navigator_mis_takeoff_too_low", "takeoff.too_low", plan("multicopter", takeoff(0), waypoint(), RETURN), {}),
    ("navigator_mis_takeoff_not_first", "takeoff.not_first", multicopter(waypoint(), takeoff()), {}),
    (
        "navigator_mis_multiple_land",
        "fixed_wing.landing_not_last",
        plan("fixed_wing", wing_takeoff(), FAR, land(), FAR, land()),
        {},
    ),
    (
        "navigator_mis_land_before_rtl",
        "fixed_wing.return_does_not_land",
        plan("fixed_wing", wing_takeoff(), FAR, land(), RETURN),
        {},
    ),
    (
        "navigator_mis_takeoff_missing",
        "takeoff.missing",
        plan("multicopter", waypoint(), RETURN),
        {"MIS_TKO_LAND_REQ": 1},
    ),
    (
        "navigator_mis_takeoff_or_land_missing",
        "takeoff.missing",
        plan("multicopter", waypoint(), land()),
        {"MIS_TKO_LAND_REQ": 3},
    ),
    ("navigator_mis_land_missing", "landing.required", plan("fixed_wing", wing_takeoff(), FAR, RETURN), {}),
    ("navigator_mis_takeoff_or_land_missing", "landing.required", multicopter(waypoint()), {"MIS_TKO_LAND_REQ": 3}),
    ("navigator_mis_land_missing", "landing.required", plan("vtol", takeoff(30), FAR, RETURN), {}),
    ("navigator_mis_add_land_or_rm_to", "landing.required", multicopter(waypoint()), {"MIS_TKO_LAND_REQ": 4}),
    ("navigator_mis_add_land_or_rm_to", "landing.required", multicopter(waypoint()), {"MIS_TKO_LAND_REQ": 5}),
    (
        "navigator_mis_add_to_or_rm_land",
        "landing.required",
        plan("multicopter", waypoint(), land()),
        {"MIS_TKO_LAND_REQ": 4},
    ),
    (
        "navigator_mis_land_wp_inside_orbit_radius",
        "fixed_wing.landing_inside_circle",
        plan("fixed_wing", wing_takeoff(), FAR, land(approach=INSIDE)),
        {},
    ),
    (
        "navigator_mis_approach_wp_below_land",
        "fixed_wing.approach_below_landing",
        plan("fixed_wing", wing_takeoff(), FAR, land(approach=BELOW)),
        {},
    ),
    (
        "navigator_mis_glide_slope_too_steep",
        "fixed_wing.glide_too_steep",
        plan("fixed_wing", wing_takeoff(), FAR, land(approach=STEEP)),
        {},
    ),
    (
        "navigator_mis_glide_slope_too_steep",
        "fixed_wing.glide_too_steep",
        plan(
            "fixed_wing", wing_takeoff(), FAR, land(approach={**at(300, 0), "relative_altitude_m": 24, "radius_m": 0})
        ),
        {"FW_LND_ANG": 3.0},
    ),
    (
        "navigator_mis_geofence_violation",
        "geofence.leg_outside",
        multicopter(waypoint(200), geofence={"polygons": [square("inclusion", 0, 0, 150)]}),
        {},
    ),
    (
        "navigator_mis_geofence_violation",
        "geofence.leg_outside",
        multicopter(waypoint(200), geofence={"circles": [circle("exclusion", 200, 0, 20)]}),
        {},
    ),
    (
        "navigator_mis_geofence_violation",
        "geofence.vehicle_distance",
        multicopter(waypoint(200)),
        {"GF_MAX_HOR_DIST": 150.0},
    ),
    (
        "navigator_mis_geofence_violation",
        "geofence.vehicle_height",
        vtol(waypoint(200, 0, 60)),
        {"GF_MAX_VER_DIST": 50.0},
    ),
]
OLD_ROWS: list[Row] = [
    ("navigator_mis_takeoff_too_low", "takeoff.too_low", plan("multicopter", takeoff(10), waypoint(), RETURN), {}),
    (
        "navigator_mis_first_wp_too_far",
        "limits.first_waypoint_too_far",
        plan("rover", waypoint(200)),
        {"MIS_DIST_1WP": 100.0},
    ),
]
"""Infeasible up to v1.15."""
NEVER_COMPILED = {
    "navigator_mis_no_home_rel_alt": "a run needs the vehicle's home before it compiles (vehicle.home_unknown)",
    "navigator_mis_invalid_land": "DO_LAND_START is written by the compiler alone, with its landing",
    "navigator_mis_unsupported_landing_approach_wp": "the compiler puts the approach before every fixed-wing landing",
}


@pytest.mark.parametrize(("event", "rule", "bad", "params"), ROWS)
def test_a_plan_that_the_autopilot_rejects_is_rejected_before_for_the_same_reason(
    event: str, rule: str, bad: Plan, params: Mapping[str, Value]
) -> None:
    facts = facts_of(bad.vehicle_type, params)
    told = [refusal.split()[0] for refusal in refusals(compile_plan(bad, facts), bad.vehicle_type, params)]
    assert event in told
    assert rule in {finding.code for finding in check_plan(bad, facts) if finding.severity is Severity.ERROR}


@pytest.mark.parametrize(("event", "rule", "bad", "params"), OLD_ROWS)
@pytest.mark.parametrize("profile", [PX4_MAIN, PX4_1_14, PX4_1_13], ids=lambda profile: profile.name)
def test_what_older_firmware_alone_rejects_is_rejected_for_it_alone(
    event: str, rule: str, bad: Plan, params: Mapping[str, Value], profile: FirmwareProfile
) -> None:
    facts = facts_of(bad.vehicle_type, params, profile)
    told = [refusal.split()[0] for refusal in refusals(compile_plan(bad, facts), bad.vehicle_type, params, profile)]
    is_old = profile is not PX4_MAIN
    assert (event in told) == is_old
    assert (rule in {finding.code for finding in check_plan(bad, facts)}) == is_old


@pytest.mark.parametrize(("asked_speed_m_s", "is_refused"), [(None, True), (4.0, False)])
def test_a_vtol_in_flight_is_sent_no_mission_that_starts_with_its_landing(
    asked_speed_m_s: float | None, is_refused: bool
) -> None:
    now = InFlight(**at(100, 0), relative_altitude_m=30.0, asked_speed_m_s=asked_speed_m_s)
    facts, rest = replace(facts_of(VehicleType.VTOL, {}), in_flight=now), plan("vtol", land())
    told = [refusal.split()[0] for refusal in refusals(compile_plan(rest, facts), VehicleType.VTOL, {}, landed=False)]
    assert ("navigator_mis_starts_w_landing2" in told) == is_refused
    assert ("landing.first" in {finding.code for finding in check_plan(rest, facts)}) == is_refused


def test_each_check_of_the_autopilot_has_its_plan_or_a_reason_why_there_is_none() -> None:
    tree = ast.parse(Path(feasibility.__file__).read_text(encoding="utf-8"))
    names = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    checks = {name for name in names if name.startswith("navigator_mis_")}
    assert checks == {row[0] for row in (*ROWS, *OLD_ROWS)} | set(NEVER_COMPILED)


@pytest.mark.parametrize("good", [multicopter(waypoint()), vtol(waypoint()), fixed_wing(FAR)])
def test_what_is_right_is_rejected_by_neither(good: Plan) -> None:
    facts = facts_of(good.vehicle_type, {})
    assert refusals(compile_plan(good, facts), good.vehicle_type, {}) == []
    assert not [finding for finding in check_plan(good, facts) if finding.severity is Severity.ERROR]
