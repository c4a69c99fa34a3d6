"""Cases of the rules about alternates, and what the other rules say of the way over them."""

from __future__ import annotations

from typing import Any

from app.domain.plan import Plan
from tests.support.plan_pieces import (
    Json,
    at,
    delay,
    facts,
    gripper,
    land,
    loiter,
    multicopter,
    rover,
    square,
    waypoint,
)
from tests.support.rule_case import Case

SPEED = {"type": "change_speed", "speed_m_s": 4}


def alternate(north_m: float = 100, east_m: float = 80, altitude_m: float = 30, **more: Any) -> Json:
    return at(north_m, east_m, relative_altitude_m=altitude_m, **more)


def delivery(**more: Any) -> Plan:
    """A delivery whose drop has an alternate, with these fields."""
    return multicopter(waypoint(), gripper(alternate=alternate(**more)))


DELIVERY = delivery()

ALTERNATE_CASES = [
    Case(
        "alternate.not_possible",
        "/items/2/alternate",
        multicopter(waypoint(), gripper(mode="embedded", alternate=alternate())),
        DELIVERY,
        about="embedded",
    ),
    Case(
        "alternate.not_possible",
        "/items/3/alternate",
        multicopter(waypoint(), gripper(), gripper(action="grab", alternate=alternate())),
        DELIVERY,
        about="a grab",
    ),
    Case(
        "alternate.not_possible",
        "/items/2/alternate",
        multicopter(land(50), gripper(alternate=alternate()), waypoint()),
        multicopter(loiter(), gripper(alternate=alternate())),
        about="from the ground",
    ),
    Case(
        "alternate.more_at_the_place",
        "/items/2/alternate",
        multicopter(waypoint(), gripper(alternate=alternate()), gripper(action="grab")),
        multicopter(waypoint(), gripper(alternate=alternate()), SPEED, delay(), waypoint(), gripper(action="grab")),
    ),
    Case(
        "alternate.return_along_items",
        "/items/2/alternate",
        DELIVERY,
        DELIVERY,
        facts(RTL_TYPE=4),
        facts(RTL_TYPE=5),
    ),
    Case(
        "alternate.same_place",
        "/items/2/alternate",
        delivery(north_m=100, east_m=4),
        rover(waypoint(100, 0, 0), gripper(alternate=alternate(100, 30, 0))),
    ),
]

LIMITED = {"limits": {"max_relative_altitude_m": 40, "max_distance_m": 150}}
KEPT_OUT = {"geofence": {"polygons": [square("exclusion", 100, 40, 10), square("exclusion", 50, 40, 5)]}}

DETOUR_CASES = [
    Case(
        "limits.altitude",
        "/items/2/alternate",
        multicopter(waypoint(), gripper(alternate=alternate(altitude_m=60)), **LIMITED),
        multicopter(waypoint(), gripper(alternate=alternate()), **LIMITED),
        about="at an alternate",
    ),
    Case(
        "limits.distance",
        "/items/2/alternate",
        multicopter(waypoint(), gripper(alternate=alternate(east_m=200)), **LIMITED),
        multicopter(waypoint(), gripper(alternate=alternate()), **LIMITED),
        about="at an alternate",
    ),
    Case(
        "limits.duration",
        "/limits/max_duration_s",
        multicopter(waypoint(), gripper(hold_s=300, alternate=alternate()), limits={"max_duration_s": 200}),
        multicopter(waypoint(), gripper(hold_s=300), limits={"max_duration_s": 200}),
        about="with a hold that ends in vain, and the way to the alternate",
    ),
    Case(
        "geofence.leg_outside",
        "/items/2/alternate",
        multicopter(waypoint(), gripper(alternate=alternate()), waypoint(200, 120), **KEPT_OUT),
        multicopter(waypoint(), gripper(alternate=alternate(160)), waypoint(200, 0), **KEPT_OUT),
        about="on the way to an alternate",
    ),
    Case(
        "geofence.leg_outside",
        "/items/3",
        multicopter(waypoint(160), gripper(alternate=alternate(160)), waypoint(40, 0), **KEPT_OUT),
        multicopter(waypoint(160), gripper(alternate=alternate(160)), waypoint(160, 0), **KEPT_OUT),
        about="on the way from an alternate",
    ),
    Case(
        "drop.consent_hold_too_short",
        "/items/2/alternate/hold_s",
        delivery(consent="operator", hold_s=9),
        delivery(consent="operator", hold_s=10),
        about="at an alternate",
    ),
    Case(
        "drop.hold_too_short",
        "/items/2/alternate/hold_s",
        delivery(hold_s=3),
        delivery(hold_s=5),
        about="at an alternate",
    ),
    Case(
        "geofence.vehicle_distance",
        "/items/2/alternate",
        delivery(east_m=400),
        DELIVERY,
        facts(GF_MAX_HOR_DIST=300),
        facts(GF_MAX_HOR_DIST=300),
        about="at an alternate",
    ),
]
