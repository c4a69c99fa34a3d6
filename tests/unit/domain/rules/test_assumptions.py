"""What is not known of a vehicle is assumed, and a finding that rests on it says so: it refuses no plan for any."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import app.domain
from app.domain.plan import Plan, parse_plan
from app.domain.rules import RULES, check_plan
from app.domain.validation.finding import Finding
from app.domain.vehicle.state import GlobalPosition, VehicleProfile
from tests.support.near_the_limits import PLANS, VEHICLES, NearTheLimits
from tests.support.plan_pieces import RETURN, Json, at, facts, plan, takeoff, waypoint
from tests.support.plan_strategies import PLANS as ANY_PLANS
from tests.support.plan_strategies import sensible_plans, vehicle_facts
from tests.support.plans_and_vehicles import PARAMS
from tests.support.rule_case import codes, errors
from tests.support.rule_cases import CASES

DEPENDENT = {
    "drop.offset_not_reachable",
    "fixed_wing.glide_too_steep",
    "geofence.leg_outside",
    "landing.required",
    "limits.duration",
    "limits.first_waypoint_too_far",
    "limits.return_altitude",
    "limits.return_speed",
    "limits.speed",
    "loiter.radius_too_small",
    "speed.not_flyable",
    "takeoff.too_low",
    "target.not_caught",
    "vehicle.altitudes_not_comparable",
    "vtol.return_to_landing",
    "wind.too_strong",
}
"""Rules whose errors may rest on a default. Where the default allows what others forbid, there is no finding."""
DOMAIN = Path(app.domain.__file__).parent
BY_PLAN = pytest.mark.parametrize("near", PLANS, ids=str)


@BY_PLAN
def test_a_plan_for_any_vehicle_is_refused_only_for_what_none_could_fly(near: NearTheLimits) -> None:
    checked = parse_plan(near.document)
    assert errors(checked) == ([near.never] if near.never else [])
    found = {finding.code: finding for finding in check_plan(checked, None)}
    assert (near.depends in found) == (near.depends != "" and near.warned)
    if near.depends in found:
        assert found[near.depends].severity == "warning"
        assert found[near.depends].message.startswith("depends on the vehicle: ")
        assert found[near.depends].assumed


@BY_PLAN
def test_checked_against_a_vehicle_it_is_an_error(near: NearTheLimits) -> None:
    for name in near.vehicles:
        expected = near.code_for(name)
        assert set(errors(parse_plan(near.document), VEHICLES[name])) == ({expected} if expected else set()), name


def test_an_error_of_any_other_rule_rests_on_the_plan_alone() -> None:
    errors_of = {rule.code for rule in RULES if rule.severity == "error"}
    found = [
        finding
        for case in CASES
        for finding in check_plan(case.wrong, None, case.wrong_wind)
        if finding.code == case.code in errors_of
    ]
    assert {finding.code for finding in found if finding.severity == "warning"} == DEPENDENT
    assert all((finding.severity == "warning") == bool(finding.assumed) for finding in found)


def test_a_vehicle_that_does_not_tell_a_fact_is_held_to_what_is_assumed() -> None:
    finding = _only(plan("multicopter", takeoff(3), waypoint(), RETURN), VEHICLES["silent"], "takeoff.too_low")
    assert finding.severity == "error"
    assert finding.assumed == ("NAV_ACC_RAD", "firmware")
    assert "because the vehicle does not report it: NAV_ACC_RAD, firmware" in finding.message


def test_only_what_is_not_known_is_named() -> None:
    low = plan("multicopter", takeoff(3), waypoint(), RETURN)
    without_version = _only(low, facts(firmware=None), "takeoff.too_low")
    assert without_version.assumed == ("firmware",)
    old = _only(low, VEHICLES["old"], "takeoff.too_low")
    assert (old.assumed, old.message) == ((), "a takeoff to 3 m above home is too low")


def test_no_height_is_made_up_where_nobody_knows_how_high_home_is() -> None:
    """The lowest absolute altitude is a guess: a takeoff to it is not one "to 0 m above home"."""
    up = {"type": "takeoff", "absolute_altitude_m": 503.0}
    there = {**waypoint(), "relative_altitude_m": None, "absolute_altitude_m": 520.0}
    checked = plan("multicopter", up, there, RETURN, home=None, limits={"max_relative_altitude_m": 10})
    assert codes(checked) == {"vehicle.altitudes_not_comparable"}
    assert errors(checked, facts()) == ["limits.altitude", "limits.altitude"]


def test_whether_a_polygon_over_half_the_earth_crosses_itself_rests_on_where_home_is() -> None:
    """Straight lines of the local frame are drawn around home: some metres decide, a thousand kilometres away."""
    far = {"latitude_deg": 0.0, "longitude_deg": 9.0}
    fence = {"polygons": [{"kind": "exclusion", "vertices": [at(-1.0, 0.0), at(0.0, 0.0), far, at(1.0, 0.0)]}]}
    checked = plan("multicopter", {**waypoint(), **at(0.0, 0.0)}, home=None, geofence=fence)
    finding = _only(checked, None, "geofence.self_crossing")
    assert (finding.severity, finding.assumed) == ("warning", ("home",))


@pytest.mark.parametrize("up", [[], [{"type": "takeoff", "relative_altitude_m": 20.0}]])
def test_whether_a_plan_without_places_stays_inside_its_fence_rests_on_where_home_is(up: list[Json]) -> None:
    delay = {"type": "delay", "duration_s": 1.0}
    around_null_island = [{"latitude_deg": 1.0, "longitude_deg": longitude} for longitude in (-1.0, 1.0)]
    corners = [*around_null_island, {"latitude_deg": -1.0, "longitude_deg": 0.0}]
    fence = {"polygons": [{"kind": "exclusion", "vertices": corners}]}
    checked = plan("multicopter", *up, delay, delay, home=None, geofence=fence)
    assert "geofence.leg_outside" not in errors(checked)


def test_a_place_in_an_exclusion_is_refused_wherever_home_is() -> None:
    up: Json = {"type": "takeoff", "relative_altitude_m": 20.0}
    corners = [at(-50, -50), at(-50, 50), at(50, 50), at(50, -50)]
    fence = {"polygons": [{"kind": "exclusion", "vertices": corners}]}
    checked = plan("multicopter", up, {**waypoint(), **at(0.0, 0.0)}, home=None, geofence=fence)
    assert "geofence.leg_outside" in errors(checked)


def test_whether_a_polygon_of_the_least_area_has_one_rests_on_where_home_is() -> None:
    """Metres of the local frame differ by parts in a thousand from one home to another."""
    corners = [
        {"latitude_deg": 47.397741999993094, "longitude_deg": 8.545633857364095},
        {"latitude_deg": 47.397741999987716, "longitude_deg": 8.54564714315211},
        {"latitude_deg": 47.39775998643212, "longitude_deg": 8.545593999999994},
    ]
    fence = {"polygons": [{"kind": "exclusion", "vertices": corners}]}
    checked = plan("multicopter", waypoint(), home=None, geofence=fence)
    finding = _only(checked, None, "geofence.self_crossing")
    assert (finding.severity, finding.assumed) == ("warning", ("home",))


def test_a_finding_of_another_type_of_vehicle_rests_on_nothing_that_this_one_tells() -> None:
    low = plan("multicopter", takeoff(3), waypoint(), RETURN)
    assert errors(low, VEHICLES["plane"]) == ["vehicle.type_differs"]


def test_a_warning_depends_on_the_vehicle_too() -> None:
    far = plan("multicopter", takeoff(**at(10_100, 0)), RETURN)
    finding = _only(far, None, "limits.first_waypoint_too_far")
    assert (finding.severity, finding.assumed) == ("warning", ("MIS_DIST_1WP", "firmware"))


def test_facts_that_may_be_unknown_are_read_where_that_is_noted() -> None:
    readers = {
        path.name
        for path in DOMAIN.rglob("*.py")
        if re.search(r"\bfacts\.(firmware|home|parameters)\b", path.read_text(encoding="utf-8"))
    }
    assert readers <= {"parameters.py", "versions.py", "walk.py", "registry.py", "gripper.py"}


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_what_refuses_a_plan_for_any_vehicle_refuses_it_for_each(data: st.DataObject) -> None:
    checked = data.draw(ANY_PLANS | sensible_plans())
    vehicle = replace(data.draw(vehicle_facts(checked.vehicle_type)), home=_home(checked))
    vehicle = replace(vehicle, parameters={**vehicle.parameters, **data.draw(PARAMS)})
    assert set(errors(checked)) <= set(errors(checked, vehicle))


def _home(checked: Plan) -> GlobalPosition:
    home = checked.home
    if home is None:
        return GlobalPosition(47.4, 8.5, 500.0)
    return GlobalPosition(home.latitude_deg, home.longitude_deg, home.absolute_altitude_m)


def _only(checked: Plan, vehicle: VehicleProfile | None, code: str) -> Finding:
    (finding,) = (found for found in check_plan(checked, vehicle) if found.code == code)
    return finding
