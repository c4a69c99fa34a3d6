"""Where a moving target can be met, and what that makes of a plan."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.geo import LocalProjection, distance_m
from app.domain.items.drop_places import Target
from app.domain.items.fields import Point
from app.domain.plan import parse_plan
from app.domain.plan.intercept import (
    LONGEST_AHEAD_S,
    SETTLE_S,
    Aim,
    NoAim,
    aim,
    approach_speeds_m_s,
    follower_at,
    intercept_s,
    moved,
)
from app.domain.rules import check_plan
from app.domain.targets import STALE_S, TargetFix, TargetReport
from tests.support.plan_pieces import HOME, at, facts, multicopter, waypoint
from tests.support.target_cases import RIGHT, chase

SHIP = Target(feed="ship-1", max_move_m=200, max_speed_m_s=5)
PLANNED = Point(**at(300, 0))
HERE = (HOME.latitude_deg, HOME.longitude_deg)


def fix(
    north_m: float = 300, east_m: float = 0, north_m_s: float = 0, east_m_s: float = 0, age_s: float = 0.0
) -> TargetFix:
    place = at(north_m, east_m)
    report = TargetReport(**place, north_m_s=north_m_s, east_m_s=east_m_s, time=1000.0)
    return TargetFix("ship-1", report, age_s)


METRES = st.floats(-5000, 5000)
SPEEDS = st.floats(-40, 40)


@given(METRES, METRES, SPEEDS, SPEEDS, st.floats(0.5, 30))
def test_whoever_flies_to_the_meeting_point_meets_the_target_there(
    north_m: float, east_m: float, north_m_s: float, east_m_s: float, speed_m_s: float
) -> None:
    after_s = intercept_s(north_m, east_m, north_m_s, east_m_s, speed_m_s)
    if after_s is None or after_s > 1e6:
        return
    way_m = math.hypot(north_m + north_m_s * after_s, east_m + east_m_s * after_s)
    assert way_m == pytest.approx(speed_m_s * after_s, rel=1e-6, abs=1e-3)


@given(METRES, METRES, SPEEDS, SPEEDS, st.floats(0.1, 30))
def test_a_faster_vehicle_always_meets_the_target(
    north_m: float, east_m: float, north_m_s: float, east_m_s: float, faster_m_s: float
) -> None:
    speed_m_s = math.hypot(north_m_s, east_m_s) + faster_m_s
    assert intercept_s(north_m, east_m, north_m_s, east_m_s, speed_m_s) is not None


def test_a_target_that_runs_away_faster_is_never_met() -> None:
    assert intercept_s(100, 0, 6, 0, 5) is None
    assert intercept_s(100, 0, 5, 0, 5) is None
    assert intercept_s(100, 0, -5, 0, 5) == pytest.approx(10)
    assert intercept_s(0, 0, 5, 0, 5) == 0
    assert intercept_s(0, 2e-162, 0, 0, 0.25) == 0


@given(METRES, METRES, SPEEDS, SPEEDS, st.floats(0, 2 * STALE_S), st.floats(0.5, 30), st.floats(1, 5000))
def test_the_waypoint_never_leaves_the_bounds_of_its_plan(
    north_m: float, east_m: float, north_m_s: float, east_m_s: float, age_s: float, speed_m_s: float, most_m: float
) -> None:
    target = SHIP.model_copy(update={"max_move_m": most_m})
    found = aim(target, PLANNED, fix(north_m, east_m, north_m_s, east_m_s, age_s), HERE, speed_m_s)
    if isinstance(found, NoAim):
        assert found.reason.code.value.startswith("target.")
        return
    away_m = distance_m(PLANNED.latitude_deg, PLANNED.longitude_deg, found.latitude_deg, found.longitude_deg)
    assert away_m == pytest.approx(found.moved_m)
    assert away_m <= most_m
    assert found.after_s <= LONGEST_AHEAD_S + SETTLE_S
    assert age_s <= STALE_S


@given(st.floats(-4, 4), st.floats(-2, 2), st.floats(0, STALE_S))
def test_the_vehicle_is_there_some_seconds_before_the_target(north_m_s: float, east_m_s: float, age_s: float) -> None:
    target = SHIP.model_copy(update={"max_move_m": 5000.0})
    known = fix(200, 50, north_m_s, east_m_s, age_s)
    found = aim(target, PLANNED, known, HERE, 6.0)
    assert isinstance(found, Aim)
    assert distance_m(*HERE, found.latitude_deg, found.longitude_deg) == pytest.approx(
        6.0 * (found.after_s - SETTLE_S), abs=0.1
    )
    assert distance_m(*known.place(found.after_s), found.latitude_deg, found.longitude_deg) < 0.1


@pytest.mark.parametrize(
    ("known", "speed_m_s", "code"),
    [
        (None, 5, "target.feed_silent"),
        (fix(age_s=STALE_S + 0.1), 5, "target.stale"),
        (fix(age_s=math.nan), 5, "target.stale"),
        (fix(north_m_s=5.1), 8, "target.too_fast"),
        (fix(north_m_s=4), 3, "target.unreachable"),
        (fix(north_m=600), 5, "target.out_of_bounds"),
        (fix(east_m_s=4.5), 5, "target.out_of_bounds"),
    ],
)
def test_the_reason_why_a_target_is_not_followed_is_said(known: TargetFix | None, speed_m_s: float, code: str) -> None:
    found = aim(SHIP, PLANNED, known, HERE, speed_m_s)
    assert isinstance(found, NoAim)
    assert found.reason.code == code
    assert found.reason


def test_a_report_foretells_where_the_target_is_now() -> None:
    known = fix(300, 0, 2, -1, age_s=3)
    east_m, north_m = LocalProjection(*HERE).to_local(*known.place())
    assert (north_m, east_m) == (pytest.approx(306, abs=0.01), pytest.approx(-3, abs=0.01))
    seen = known.evidence(*HERE)
    assert (seen.age_s, seen.distance_m) == (3, pytest.approx(306, abs=0.1))
    assert known.evidence(None, None).distance_m is None


def test_a_moved_plan_remembers_where_it_was_planned_and_stays_a_plan() -> None:
    plan = RIGHT
    follower = follower_at(plan, plan.items[1].id)
    assert follower is not None
    for north_m in (120, 80):
        place = at(north_m, 10)
        plan = moved(plan, follower, place["latitude_deg"], place["longitude_deg"])
        assert parse_plan(plan.model_dump(mode="json")) == plan
        assert check_plan(plan, None) == check_plan(RIGHT, None)
        follower = follower_at(plan, plan.items[1].id)
        assert follower is not None
        assert follower.planned == Point(**at(100, 0))
        assert follower.distance_m(place["latitude_deg"], place["longitude_deg"]) == 0
    beyond = at(151, 0)
    far = moved(plan, follower, beyond["latitude_deg"], beyond["longitude_deg"])
    assert [finding.code for finding in check_plan(far, None) if finding.severity == "error"] == [
        "target.moved_too_far"
    ]


def test_only_the_waypoint_of_the_drop_follows() -> None:
    plan = multicopter(waypoint(50, id="a"), waypoint(id="b"), chase(), waypoint(20, id="c"))
    assert [item.id for item in plan.items if follower_at(plan, item.id)] == ["b"]
    assert follower_at(plan, None) is None


def test_the_speed_towards_the_waypoint_is_the_plans_or_the_vehicles_own() -> None:
    plan = multicopter(waypoint(50, id="a", speed_m_s=4), waypoint(id="b"), chase())
    assert approach_speeds_m_s(plan, facts()) == {"b": 4}
    by_itself = multicopter(waypoint(id="b"), chase())
    assert approach_speeds_m_s(by_itself, facts(MPC_XY_CRUISE=7.0)) == {"b": 7}
    assert approach_speeds_m_s(multicopter(waypoint(50, id="a")), facts()) == {}
