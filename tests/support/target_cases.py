"""Cases of the rules about drops at moving targets."""

from __future__ import annotations

from typing import Any

from tests.support.plan_pieces import (
    Json,
    at,
    circle,
    facts,
    gripper,
    loiter,
    multicopter,
    rover,
    square,
    vtol,
    waypoint,
)
from tests.support.rule_case import Case


def ship(max_move_m: float = 50, max_speed_m_s: float = 2, **more: Any) -> Json:
    return {"feed": "ship-1", "max_move_m": max_move_m, "max_speed_m_s": max_speed_m_s, **more}


def chase(**more: Any) -> Json:
    """A release at a moving target."""
    return gripper(target=ship(**more))


RIGHT = multicopter(waypoint(), chase())
INSIDE = {"polygons": [square("inclusion", 0, 0, 151)]}
KEEP_OUT = {**INSIDE, "circles": [circle("exclusion", 100, 80, 29)]}
LOOP = {"type": "jump", "target": "a", "repeats": 1}

TARGET_CASES = [
    Case(
        "target.cannot_follow",
        "/items/2/target",
        multicopter(waypoint(), gripper(mode="embedded", target=ship())),
        RIGHT,
    ),
    Case(
        "target.cannot_follow",
        "/items/2/target",
        multicopter(waypoint(), gripper(action="grab", target=ship())),
        RIGHT,
        about="a grab",
    ),
    Case(
        "target.cannot_follow",
        "/items/1/target",
        rover(waypoint(30, 0, 0), chase()),
        rover(waypoint(30, 0, 0), gripper()),
        about="a rover",
    ),
    Case(
        "target.cannot_follow",
        "/items/2/target",
        multicopter(loiter(), chase()),
        multicopter(waypoint(), chase()),
        about="a loiter",
    ),
    Case(
        "target.cannot_follow",
        "/items/2/target",
        vtol(waypoint(200), gripper("moving", target=ship())),
        vtol(waypoint(200), gripper("moving")),
        about="on the wing",
    ),
    Case(
        "target.shared",
        "/items/2/target",
        multicopter(waypoint(), chase(), gripper(action="grab")),
        multicopter(waypoint(), chase(), waypoint(50), gripper(action="grab")),
    ),
    Case(
        "target.in_loop",
        "/items/2/target",
        multicopter(waypoint(id="a"), chase(), LOOP),
        multicopter(waypoint(), chase(), waypoint(50, id="a"), LOOP),
    ),
    Case(
        "target.outside_fence",
        "/items/2/target/max_move_m",
        multicopter(waypoint(), chase(max_move_m=52), geofence=INSIDE),
        multicopter(waypoint(), chase(max_move_m=50), geofence=INSIDE),
    ),
    Case(
        "target.outside_fence",
        "/items/2/target/max_move_m",
        multicopter(waypoint(), chase(max_move_m=52), geofence=KEEP_OUT),
        multicopter(waypoint(), chase(max_move_m=50), geofence=KEEP_OUT),
        about="a keep-out",
    ),
    Case(
        "target.too_far",
        "/items/2/target/max_move_m",
        multicopter(waypoint(), chase(max_move_m=52), limits={"max_distance_m": 151}),
        multicopter(waypoint(), chase(max_move_m=50), limits={"max_distance_m": 151}),
    ),
    Case(
        "target.too_far",
        "/items/2/target/max_move_m",
        RIGHT,
        RIGHT,
        facts(GF_MAX_HOR_DIST=149),
        facts(GF_MAX_HOR_DIST=151),
        about="of the vehicle",
    ),
    Case(
        "target.moved_too_far",
        "/items/2/target/planned",
        multicopter(waypoint(), chase(planned=at(151, 0))),
        multicopter(waypoint(), chase(planned=at(149, 0))),
    ),
    Case(
        "target.not_caught",
        "/items/2/target/max_speed_m_s",
        multicopter(waypoint(speed_m_s=3), chase(max_speed_m_s=3)),
        multicopter(waypoint(speed_m_s=4), chase(max_speed_m_s=3)),
    ),
]
