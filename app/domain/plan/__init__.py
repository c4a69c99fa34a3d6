"""The delivery plan: the document a dispatcher writes, read strictly."""

from app.domain.items import (
    Approach,
    ChangeSpeed,
    Delay,
    DropItem,
    Gripper,
    Jump,
    Land,
    Loiter,
    PlanItem,
    PositionItem,
    ReturnToLaunch,
    Takeoff,
    Transition,
    Waypoint,
    Winch,
)
from app.domain.items.alternate import Alternate
from app.domain.items.target import Target
from app.domain.plan.document import Contingency, Home, Limits, Order, Plan
from app.domain.plan.geofence import FenceCircle, FencePolygon, Geofence, RallyPoint
from app.domain.plan.identity import plan_hash
from app.domain.plan.parse import PlanInvalid, parse_data, parse_plan, plan_json_schema

__all__ = [
    "Alternate",
    "Approach",
    "ChangeSpeed",
    "Contingency",
    "Delay",
    "DropItem",
    "FenceCircle",
    "FencePolygon",
    "Geofence",
    "Gripper",
    "Home",
    "Jump",
    "Land",
    "Limits",
    "Loiter",
    "Order",
    "Plan",
    "PlanInvalid",
    "PlanItem",
    "PositionItem",
    "RallyPoint",
    "ReturnToLaunch",
    "Takeoff",
    "Target",
    "Transition",
    "Waypoint",
    "Winch",
    "parse_data",
    "parse_plan",
    "plan_hash",
    "plan_json_schema",
]
