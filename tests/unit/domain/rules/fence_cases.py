"""Cases of the rules about the fence."""

from __future__ import annotations

from app.domain.prediction import Wind
from tests.support.plan_pieces import (
    Json,
    at,
    circle,
    facts,
    fixed_wing,
    land,
    loiter,
    multicopter,
    plan,
    square,
    takeoff,
    waypoint,
)
from tests.support.rule_case import Case

FLIGHT = multicopter(waypoint())
WING_FLIGHT = plan("fixed_wing", takeoff(40, **at(160, 0)), waypoint(200, 0), waypoint(200, 90), land())
NEAR_FENCE = {"polygons": [square("inclusion", 50, 0, 100)]}
BOW_TIE: Json = {"kind": "inclusion", "vertices": [at(-50, -50), at(150, 50), at(150, -50), at(-50, 50)]}
ACROSS, BESIDE = (
    {
        "kind": "exclusion",
        "vertices": [
            {"latitude_deg": -17 + north, "longitude_deg": east} for north, east in ((0, west), (0, 179), (1, 179))
        ],
    }
    for west in (-179, 178)
)
"""Exclusions far away."""
RALLY: Json = at(60, 90, relative_altitude_m=20)
PILLAR = {"circles": [circle("exclusion", 100, 90, 10)]}
"""On the straight way to the rally point, and not on the way home."""
ON_THE_WAY_HOME = {"polygons": [square("exclusion", 30, 45, 5)]}
WALLED_IN = (
    {"kind": "inclusion", "vertices": [at(-20, -20), at(80, -20), at(80, 110), at(-20, 110)]},
    {"kind": "exclusion", "vertices": [at(-30, 60), at(45, 60), at(45, 64), at(-30, 64)]},
)
"""A wall that leaves less room than the margins on both of its sides."""
RIDGES: tuple[Json, ...] = tuple(
    {
        "kind": "exclusion",
        "vertices": [
            *(at(120 * n + 30 * (tooth % 2), 20 + 60 * tooth) for tooth in range(40)),
            *(at(120 * n + 5 + 30 * (tooth % 2), 20 + 60 * tooth) for tooth in reversed(range(40))),
        ],
    }
    for n in range(1, 61)
)
"""Exclusions like the teeth of saws, one behind the other: more corners than are searched."""
TWO_AROUND_HOME = {"polygons": [square("inclusion", 50, 0, 100), square("inclusion", 0, 0, 60)]}

GEOFENCE_CASES = [
    Case(
        "geofence.self_crossing",
        "/geofence/polygons/0/vertices",
        multicopter(waypoint(), geofence={"polygons": [BOW_TIE]}),
        multicopter(waypoint(), geofence=NEAR_FENCE),
    ),
    Case(
        "geofence.self_crossing",
        "/geofence/polygons/0/vertices",
        multicopter(waypoint(), geofence={"polygons": [square("exclusion", 50, 50, 0.35)]}),
        multicopter(waypoint(), geofence={"polygons": [square("exclusion", 50, 50, 0.6)]}),
        about="too small",
    ),
    Case(
        "geofence.antimeridian",
        "/geofence/polygons/0/vertices",
        multicopter(waypoint(), geofence={"polygons": [ACROSS]}),
        multicopter(waypoint(), geofence={"polygons": [BESIDE]}),
    ),
    Case(
        "geofence.home_outside",
        "/geofence",
        multicopter(waypoint(), geofence={"polygons": [square("inclusion", 200, 0, 150)]}),
        multicopter(waypoint(), geofence=NEAR_FENCE),
    ),
    Case(
        "geofence.home_outside",
        "/geofence",
        multicopter(waypoint(), geofence={"circles": [circle("exclusion", 0, 10, 15)]}),
        multicopter(waypoint(), geofence={"circles": [circle("exclusion", 0, 40, 15)]}),
        about="in an exclusion",
    ),
    Case(
        "geofence.leg_outside",
        "/items/1",
        plan("multicopter", takeoff(), waypoint(200), geofence=NEAR_FENCE),
        plan("multicopter", takeoff(), waypoint(140), geofence=NEAR_FENCE),
        about="a waypoint outside",
    ),
    Case(
        "geofence.leg_outside",
        "/items/1",
        multicopter(waypoint(100), waypoint(100, 60), geofence={"circles": [circle("exclusion", 50, 5, 10)]}),
        multicopter(waypoint(100), waypoint(100, 60), geofence={"circles": [circle("exclusion", 50, -15, 10)]}),
        about="a leg through an exclusion",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(60), waypoint(60, 90), geofence={"polygons": [square("exclusion", 30, 45, 5)]}),
        multicopter(waypoint(60), waypoint(60, 90), geofence={"polygons": [square("exclusion", 15, 45, 5)]}),
        about="the way home",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(60), waypoint(60, 90), geofence=ON_THE_WAY_HOME),
        multicopter(waypoint(60), waypoint(60, 90), geofence=ON_THE_WAY_HOME),
        facts(firmware=(1, 18, 0)),
        facts(firmware=(1, 19, 0)),
        about="the way home, round which only newer firmware flies",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(60), waypoint(60, 90), geofence={"polygons": [*WALLED_IN]}),
        multicopter(waypoint(60), waypoint(60, 90), geofence=ON_THE_WAY_HOME),
        facts(firmware=(1, 19, 0)),
        facts(firmware=(1, 19, 0)),
        about="the way home, round which there is none",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(7500), waypoint(7500, 90), geofence={"polygons": RIDGES}),
        multicopter(waypoint(7500), waypoint(7500, 90), geofence={"polygons": RIDGES[:2]}),
        facts(firmware=(1, 19, 0)),
        facts(firmware=(1, 19, 0)),
        about="the way home, round a fence of too many corners",
    ),
    Case(
        "geofence.return_round",
        "/items/3",
        multicopter(waypoint(60), waypoint(60, 90), geofence=ON_THE_WAY_HOME),
        multicopter(waypoint(60), waypoint(60, 90), geofence={"polygons": [square("exclusion", 15, 45, 5)]}),
        facts(firmware=(1, 19, 0)),
        facts(firmware=(1, 19, 0)),
    ),
    Case(
        "geofence.leg_outside",
        "/items/1",
        fixed_wing(loiter(radius_m=100), geofence={"circles": [circle("exclusion", 390, 0, 20)]}),
        fixed_wing(loiter(radius_m=60), geofence={"circles": [circle("exclusion", 390, 0, 20)]}),
        about="a circle over an exclusion",
    ),
    Case(
        "geofence.leg_outside",
        "/items/4",
        multicopter(
            waypoint(100, 0, id="a"),
            waypoint(50, 60),
            waypoint(100, 100),
            {"type": "jump", "target": "a", "repeats": 1},
            geofence={"polygons": [square("exclusion", 100, 50, 5)]},
        ),
        multicopter(
            waypoint(100, 0, id="a"),
            waypoint(50, 60),
            waypoint(100, 100),
            {"type": "jump", "target": "a", "repeats": 1},
            geofence={"polygons": [square("exclusion", 130, 50, 5)]},
        ),
        about="the way back of a jump",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(140), waypoint(140, 90), geofence=PILLAR, rally_points=[RALLY]),
        multicopter(waypoint(140), waypoint(140, 90), geofence=PILLAR),
        about="the way to a rally point",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(140), waypoint(140, 90), geofence=PILLAR, rally_points=[RALLY]),
        multicopter(waypoint(140), waypoint(140, 90), geofence=PILLAR, rally_points=[RALLY]),
        facts(RTL_TYPE=5),
        facts(RTL_TYPE=2),
        about="not on the way back along the mission",
    ),
    Case(
        "geofence.leg_outside",
        "/items/1",
        plan("multicopter", takeoff(), land(100), geofence=TWO_AROUND_HOME),
        plan("multicopter", takeoff(), land(100), geofence=TWO_AROUND_HOME),
        facts(firmware=(1, 15, 0)),
        facts(firmware=(1, 14, 3)),
        about="in one of two inclusions around home",
    ),
    Case(
        "geofence.leg_outside",
        "/items/1",
        plan("multicopter", takeoff(), land(100), geofence=TWO_AROUND_HOME),
        plan("multicopter", takeoff(), land(40), geofence=TWO_AROUND_HOME),
        facts(firmware=None),
        facts(firmware=None),
        about="in one of two inclusions around home, unknown firmware",
    ),
    Case(
        "geofence.rally_outside",
        "/rally_points/0",
        multicopter(waypoint(), geofence=NEAR_FENCE, rally_points=[at(0, 200, relative_altitude_m=20)]),
        multicopter(waypoint(), geofence=NEAR_FENCE, rally_points=[at(0, 50, relative_altitude_m=20)]),
    ),
    Case(
        "geofence.not_enforced",
        "/geofence",
        multicopter(waypoint(), geofence=NEAR_FENCE),
        multicopter(waypoint(), geofence=NEAR_FENCE),
        facts(GF_ACTION=1),
        facts(GF_ACTION=3),
    ),
    Case(
        "geofence.not_enforced",
        "/geofence",
        multicopter(waypoint(), geofence=NEAR_FENCE),
        multicopter(waypoint(), geofence=NEAR_FENCE),
        facts(GF_ACTION=4),
        facts(GF_ACTION=5),
        about="terminated",
    ),
    Case(
        "geofence.little_room",
        "/items/1",
        fixed_wing(waypoint(400), geofence={"circles": [circle("exclusion", 250, -30, 10)]}),
        fixed_wing(waypoint(400), geofence={"circles": [circle("exclusion", 250, -60, 10)]}),
    ),
    Case(
        "geofence.little_room",
        "/items/1",
        fixed_wing(waypoint(400), geofence={"circles": [circle("exclusion", 250, -60, 10)]}),
        fixed_wing(waypoint(400), geofence={"circles": [circle("exclusion", 250, -60, 10)]}),
        about="in a tail wind",
        wrong_wind=Wind(10.0, 0.0),
        right_wind=Wind(-10.0, 0.0),
    ),
    Case(
        "geofence.vehicle_distance",
        "/items/1",
        FLIGHT,
        FLIGHT,
        facts(GF_MAX_HOR_DIST=90),
        facts(GF_MAX_HOR_DIST=110),
    ),
    Case(
        "geofence.vehicle_distance",
        "/items/3",
        WING_FLIGHT,
        WING_FLIGHT,
        facts("fixed_wing", GF_MAX_HOR_DIST=250),
        facts("fixed_wing", GF_MAX_HOR_DIST=400),
        about="the computed approach counts",
    ),
    Case("geofence.vehicle_height", "/items/1", FLIGHT, FLIGHT, facts(GF_MAX_VER_DIST=20), facts(GF_MAX_VER_DIST=40)),
]
