"""Cases of the rules about limits, speeds and the vehicle's settings."""

from __future__ import annotations

from dataclasses import replace

from app.domain.autopilot.declared import default_facts
from app.domain.vehicle.state import GlobalPosition, VehicleType
from tests.support.plan_pieces import (
    HOME,
    RETURN,
    Json,
    at,
    change_speed,
    circle,
    facts,
    fixed_wing,
    gripper,
    land,
    multicopter,
    plan,
    takeoff,
    waypoint,
    wing_takeoff,
)
from tests.support.rule_case import Case
from tests.unit.domain.rules.fence_cases import NEAR_FENCE

FLIGHT = multicopter(waypoint())
SMALL = replace(default_facts(VehicleType.MULTICOPTER), max_mission_items=3, max_fence_items=4, max_rally_points=1)
ELSEWHERE = GlobalPosition(47.40, 8.545594, 488.0)


LIMIT_CASES = [
    Case("limits.mission_items", "/items", multicopter(waypoint(), waypoint(50)), FLIGHT, SMALL, SMALL),
    Case(
        "limits.mission_items",
        "/items",
        plan("multicopter", takeoff(), waypoint(), gripper(mode="embedded"), RETURN),
        plan("multicopter", takeoff(), land()),
        SMALL,
        SMALL,
        about="mission items are counted, not plan items",
    ),
    Case(
        "limits.fence_items",
        "/geofence",
        multicopter(waypoint(), geofence={**NEAR_FENCE, "circles": [circle("exclusion", 0, 50, 9)]}),
        multicopter(waypoint(), geofence=NEAR_FENCE),
        SMALL,
        SMALL,
    ),
    Case(
        "limits.rally_points",
        "/rally_points",
        multicopter(waypoint(), rally_points=[at(0, 50, relative_altitude_m=20), at(0, 60, relative_altitude_m=20)]),
        multicopter(waypoint(), rally_points=[at(0, 50, relative_altitude_m=20)]),
        SMALL,
        SMALL,
    ),
    Case(
        "limits.first_waypoint_too_far",
        "/items/0",
        plan("multicopter", takeoff(15, **at(10_001, 0)), RETURN),
        plan("multicopter", takeoff(15, **at(9_990, 0)), RETURN),
    ),
    Case(
        "limits.first_waypoint_far",
        "/items/0",
        plan("multicopter", takeoff(15, **at(300, 0)), RETURN),
        plan("multicopter", takeoff(15, **at(100, 0)), RETURN),
        facts(MIS_DIST_1WP=200),
        facts(MIS_DIST_1WP=200),
    ),
    Case("limits.below_home", "/items/1", multicopter(waypoint(altitude_m=-5)), multicopter(waypoint(altitude_m=5))),
    Case(
        "limits.altitude",
        "/items/1",
        multicopter(waypoint(), limits={"max_relative_altitude_m": 25}),
        multicopter(waypoint(), limits={"max_relative_altitude_m": 30}),
    ),
    Case(
        "limits.distance",
        "/items/1",
        multicopter(waypoint(), limits={"max_distance_m": 99}),
        multicopter(waypoint(), limits={"max_distance_m": 101}),
    ),
    Case(
        "limits.speed",
        "/items/0",
        multicopter(waypoint(), limits={"max_speed_m_s": 4}),
        multicopter(waypoint(), limits={"max_speed_m_s": 4}, cruise_speed_m_s=4),
    ),
    Case(
        "limits.drop_height",
        "/items/2",
        multicopter(waypoint(100, 0, 30), gripper(), limits={"max_drop_height_m": 20}),
        multicopter(waypoint(100, 0, 20), gripper(), limits={"max_drop_height_m": 20}),
    ),
    Case(
        "limits.drop_height",
        "/items/2",
        multicopter(waypoint(100, 0, 30), gripper("moving"), waypoint(0), limits={"max_drop_height_m": 20}),
        multicopter(land(100), gripper(), waypoint(0), limits={"max_drop_height_m": 20}),
        about="not of a landed one",
    ),
    Case(
        "limits.duration",
        "/limits/max_duration_s",
        multicopter(waypoint(), limits={"max_duration_s": 60}),
        multicopter(waypoint(), limits={"max_duration_s": 200}),
    ),
    Case(
        "speed.not_flyable",
        "/items/1/speed_m_s",
        fixed_wing(waypoint(400, speed_m_s=8)),
        fixed_wing(waypoint(400, speed_m_s=12)),
        about="below the stall speed",
    ),
    Case(
        "speed.not_flyable",
        "/items/0/speed_m_s",
        plan("fixed_wing", change_speed(8), wing_takeoff(), waypoint(400, 400, 40), land()),
        plan("fixed_wing", change_speed(12), wing_takeoff(), waypoint(400, 400, 40), land()),
        about="below the stall speed, on the ground",
    ),
    Case(
        "limits.speed",
        "/items/1",
        plan("multicopter", change_speed(9), takeoff(), waypoint(), RETURN, limits={"max_speed_m_s": 8}),
        plan("multicopter", change_speed(7), takeoff(), waypoint(), RETURN, limits={"max_speed_m_s": 8}),
        about="from the ground on",
    ),
    Case(
        "speed.not_flyable",
        "/cruise_speed_m_s",
        multicopter(waypoint(), cruise_speed_m_s=20),
        multicopter(waypoint(), cruise_speed_m_s=10),
        about="too fast",
    ),
]

HIGH_RALLY = {"rally_points": [at(90, 0, relative_altitude_m=25)]}
LOW_LIMIT: Json = {"limits": {"max_relative_altitude_m": 20}}
SLOW: Json = {"limits": {"max_speed_m_s": 4}, "cruise_speed_m_s": 4}
SLOW_TO_LAND = ("multicopter", takeoff(), waypoint(), gripper(), land(50))
TO_LAND = plan("multicopter", takeoff(), waypoint(altitude_m=15), land(50), **LOW_LIMIT)
FLIGHT_TO_LAND = plan("multicopter", takeoff(), waypoint(), land(50))
RETURN_CASES = [
    Case(
        "limits.return_altitude",
        "/items/2",
        multicopter(waypoint(altitude_m=15), **LOW_LIMIT),
        multicopter(waypoint(altitude_m=15), **LOW_LIMIT),
        facts(RTL_RETURN_ALT=21),
        facts(RTL_RETURN_ALT=20),
    ),
    Case(
        "limits.return_altitude",
        "/items/2",
        multicopter(waypoint(altitude_m=15), limits={"max_relative_altitude_m": 40}, **HIGH_RALLY),
        multicopter(waypoint(altitude_m=15), limits={"max_relative_altitude_m": 40}),
        about="above a rally point",
    ),
    Case(
        "limits.return_altitude",
        "/items/2",
        multicopter(waypoint(altitude_m=15), **LOW_LIMIT),
        multicopter(waypoint(15, altitude_m=15), **LOW_LIMIT),
        facts(RTL_MIN_DIST=18),
        facts(RTL_MIN_DIST=18),
        about="less high near home",
    ),
    Case(
        "limits.return_altitude",
        "/contingency/on_drop_failure",
        plan(
            "multicopter",
            *(takeoff(), waypoint(altitude_m=15), gripper(), land(50)),
            contingency={"on_drop_failure": "return"},
            **LOW_LIMIT,
        ),
        plan("multicopter", takeoff(), waypoint(altitude_m=15), gripper(), land(50), **LOW_LIMIT),
        about="after a failed drop",
    ),
    Case(
        "limits.return_speed",
        "/items/2",
        multicopter(waypoint(), **SLOW),
        multicopter(waypoint(), **SLOW),
        facts(MPC_XY_CRUISE=4.5),
        facts(MPC_XY_CRUISE=4),
    ),
    Case(
        "limits.return_speed",
        "/items/2",
        multicopter(waypoint(), **SLOW),
        multicopter(waypoint(), **SLOW),
        facts(),
        facts(RTL_TYPE=2),
        about="not along the items, as slowly as they were flown",
    ),
    Case(
        "limits.return_speed",
        "/contingency/on_drop_failure",
        plan(*SLOW_TO_LAND, contingency={"on_drop_failure": "return"}, **SLOW),
        plan(*SLOW_TO_LAND, **SLOW),
        about="after a failed drop",
    ),
    Case(
        "limits.failsafe_speed",
        "/limits/max_speed_m_s",
        plan(*SLOW_TO_LAND, **SLOW),
        plan(*SLOW_TO_LAND, **SLOW),
        facts(),
        facts(MPC_XY_CRUISE=4),
    ),
    Case(
        "limits.failsafe_altitude",
        "/limits/max_relative_altitude_m",
        TO_LAND,
        TO_LAND,
        facts(RTL_RETURN_ALT=30),
        facts(RTL_RETURN_ALT=20),
    ),
    Case(
        "geofence.return_height",
        "/items/2",
        FLIGHT,
        FLIGHT,
        facts(GF_MAX_VER_DIST=40, RTL_RETURN_ALT=60),
        facts(GF_MAX_VER_DIST=40, RTL_RETURN_ALT=35),
    ),
    Case(
        "geofence.return_height",
        "/items/2",
        FLIGHT,
        FLIGHT,
        facts(GF_MAX_VER_DIST=40, RTL_RETURN_ALT=60),
        facts(GF_MAX_VER_DIST=40, RTL_RETURN_ALT=60, RTL_TYPE=2),
        about="not along the mission",
    ),
    Case(
        "geofence.failsafe_height",
        "",
        FLIGHT_TO_LAND,
        FLIGHT_TO_LAND,
        facts(GF_MAX_VER_DIST=40, RTL_RETURN_ALT=60),
        facts(GF_MAX_VER_DIST=60, RTL_RETURN_ALT=60),
    ),
    Case(
        "limits.rally_point",
        "/rally_points/0",
        multicopter(waypoint(50), limits={"max_distance_m": 80}, **HIGH_RALLY),
        multicopter(waypoint(50), limits={"max_distance_m": 100}, **HIGH_RALLY),
    ),
    Case(
        "limits.rally_point",
        "/rally_points/0",
        multicopter(waypoint(50), limits={"max_relative_altitude_m": 24}, **HIGH_RALLY),
        multicopter(waypoint(50), limits={"max_relative_altitude_m": 30}, **HIGH_RALLY),
        about="too high",
    ),
    Case(
        "geofence.vehicle_rally",
        "/rally_points/0",
        multicopter(waypoint(50), **HIGH_RALLY),
        multicopter(waypoint(50), **HIGH_RALLY),
        facts(GF_MAX_HOR_DIST=80),
        facts(GF_MAX_HOR_DIST=100),
    ),
    Case(
        "geofence.vehicle_rally",
        "/rally_points/0",
        multicopter(waypoint(50), **HIGH_RALLY),
        multicopter(waypoint(50), **HIGH_RALLY),
        facts(GF_MAX_VER_DIST=24),
        facts(GF_MAX_VER_DIST=30),
        about="too high",
    ),
]

ABSOLUTE: Json = {"type": "waypoint", **at(100, 0), "absolute_altitude_m": 510}
RELATIVE: Json = {"type": "waypoint", **at(50, 0), "relative_altitude_m": 20}
VEHICLE_CASES = [
    Case("vehicle.type_differs", "/vehicle_type", FLIGHT, FLIGHT, facts("vtol"), facts()),
    Case("vehicle.home_unknown", "", FLIGHT, FLIGHT, facts(home=None), facts()),
    Case("vehicle.home_differs", "/home", FLIGHT, FLIGHT, facts(home=ELSEWHERE), facts(home=HOME)),
    Case(
        "vehicle.altitudes_not_comparable",
        "/items/2",
        multicopter(RELATIVE, ABSOLUTE, home=None),
        multicopter(RELATIVE, ABSOLUTE),
    ),
    Case(
        "vehicle.clock_too_fast",
        "/items/2",
        multicopter(waypoint(), gripper()),
        multicopter(waypoint(), gripper()),
        replace(facts(), least_clock_rate=4.1),
        replace(facts(), least_clock_rate=4.0),
    ),
    Case(
        "vehicle.clock_too_fast",
        "/items/2",
        multicopter(waypoint(), gripper()),
        multicopter(waypoint(), gripper(mode="embedded")),
        replace(facts(), least_clock_rate=50.0),
        replace(facts(), least_clock_rate=50.0),
        about="embedded drops may",
    ),
    Case(
        "contingency.link_loss_unset",
        "/items/2",
        multicopter(waypoint(), gripper()),
        multicopter(waypoint(), gripper()),
        facts(NAV_DLL_ACT=0),
        facts(NAV_DLL_ACT=2),
    ),
    Case(
        "contingency.link_loss_unset",
        "/items/2",
        multicopter(waypoint(), gripper()),
        multicopter(waypoint(), gripper(), contingency={"on_link_loss": "continue"}),
        facts(NAV_DLL_ACT=0),
        facts(NAV_DLL_ACT=0),
        about="unless the plan wants it so",
    ),
    Case(
        "contingency.link_loss_differs",
        "/contingency/on_link_loss",
        multicopter(waypoint(), contingency={"on_link_loss": "return"}),
        multicopter(waypoint(), contingency={"on_link_loss": "return"}),
        facts(NAV_DLL_ACT=0),
        facts(NAV_DLL_ACT=2),
    ),
]
