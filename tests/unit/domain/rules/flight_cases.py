"""Cases of the rules about takeoff, landing, transitions, fixed-wing patterns and jumps."""

from __future__ import annotations

from dataclasses import replace

from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import InFlight, VehicleProfile
from tests.support.plan_pieces import (
    HOME,
    RETURN,
    Json,
    at,
    delay,
    facts,
    fixed_wing,
    gripper,
    land,
    loiter,
    multicopter,
    plan,
    rover,
    takeoff,
    transition,
    vtol,
    waypoint,
    wing_takeoff,
)
from tests.support.rule_case import Case

FLIGHT = multicopter(waypoint())
WING_FLIGHT = fixed_wing(waypoint(400))


def _jump(target: str, repeats: int = 1, **more: object) -> Json:
    return {"type": "jump", "target": target, "repeats": repeats, **more}


def _approach(north_m: float, east_m: float, altitude_m: float = 20, radius_m: float = 60) -> Json:
    return land(approach=at(north_m, east_m, relative_altitude_m=altitude_m, radius_m=radius_m))


def _in_flight(vehicle_type: str, **more: float) -> VehicleProfile:
    now = InFlight(latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg, relative_altitude_m=30.0, **more)
    return replace(facts(vehicle_type), in_flight=now)


TAKEOFF_LANDING_CASES = [
    Case("takeoff.missing", "/items/0", plan("multicopter", waypoint(), RETURN), FLIGHT),
    Case(
        "takeoff.not_first",
        "/items/1",
        plan("multicopter", waypoint(), takeoff(), RETURN),
        plan("multicopter", delay(), takeoff(), waypoint(), RETURN),
    ),
    Case(
        "takeoff.not_first",
        "/items/3",
        plan("multicopter", takeoff(), land(50), gripper(), takeoff(), waypoint(), RETURN),
        plan("multicopter", takeoff(), land(50), gripper(), waypoint(), RETURN),
        about="a second takeoff",
    ),
    Case(
        "rover.no_takeoff_or_landing",
        "/items/0",
        plan("rover", takeoff(), waypoint(30, 0, 0)),
        rover(waypoint(30, 0, 0)),
    ),
    Case(
        "rover.no_takeoff_or_landing",
        "/items/1",
        plan("rover", waypoint(30, 0, 0), land()),
        plan("rover", waypoint(30, 0, 0), RETURN),
        about="a landing never ends",
    ),
    Case(
        "airship.no_landing",
        "/items/2",
        plan("airship", takeoff(20), waypoint(30, 0), land()),
        plan("airship", takeoff(20), waypoint(30, 0), waypoint(0, 0)),
    ),
    Case(
        "takeoff.too_low",
        "/items/0/relative_altitude_m",
        plan("multicopter", takeoff(10), waypoint(), RETURN),
        plan("multicopter", takeoff(11), waypoint(), RETURN),
        about="strict without a vehicle",
    ),
    Case(
        "takeoff.too_low",
        "/items/0/relative_altitude_m",
        plan("multicopter", takeoff(0), waypoint(), RETURN),
        plan("multicopter", takeoff(3), waypoint(), RETURN),
        facts(),
        facts(),
        about="current firmware",
    ),
    Case(
        "takeoff.fixed_wing_position",
        "/items/0",
        plan("fixed_wing", takeoff(40), waypoint(400, 0), waypoint(400, 400, 40), land()),
        WING_FLIGHT,
    ),
    Case(
        "landing.required",
        "/items/2",
        plan("vtol", takeoff(30), waypoint(300), RETURN),
        plan("vtol", takeoff(30), waypoint(300), land()),
        about="a VTOL wants a landing",
    ),
    Case(
        "landing.required",
        "/items/2",
        FLIGHT,
        plan("multicopter", takeoff(), waypoint(), land()),
        facts(MIS_TKO_LAND_REQ=4),
        facts(MIS_TKO_LAND_REQ=4),
        about="so does a multicopter that is set so",
    ),
    Case(
        "landing.required",
        "/items/1",
        rover(waypoint(30, 0, 0)),
        rover(waypoint(30, 0, 0)),
        facts("rover", MIS_TKO_LAND_REQ=2),
        facts("rover", MIS_TKO_LAND_REQ=4),
        about="a rover can fulfil none",
    ),
    Case(
        "landing.flight_does_not_end",
        "/items/1",
        plan("multicopter", takeoff(), waypoint()),
        plan("multicopter", takeoff(), waypoint(), land()),
    ),
    Case(
        "landing.flight_does_not_end",
        "/items/2",
        plan("multicopter", takeoff(), land(50), gripper()),
        plan("multicopter", takeoff(), land(50), gripper(), waypoint(), RETURN),
        about="a drop after the last landing leaves it armed",
    ),
    Case(
        "landing.ends_in_loiter",
        "/items/1",
        plan("multicopter", takeoff(), loiter("unlimited")),
        plan("multicopter", takeoff(), loiter("time"), RETURN),
    ),
    Case("landing.first", "/items/0", plan("multicopter", land(), waypoint(), RETURN), FLIGHT),
    Case(
        "landing.first",
        "/items/0",
        plan("vtol", land()),
        plan("vtol", transition("multicopter"), land()),
        _in_flight("vtol"),
        _in_flight("vtol"),
        about="a VTOL in flight",
    ),
    Case(
        "landing.first",
        "/items/0",
        plan("vtol", land()),
        plan("vtol", land()),
        _in_flight("vtol"),
        _in_flight("vtol", asked_speed_m_s=4.0),
        about="in flight, after the speed that the plan asked for",
    ),
    Case(
        "landing.first",
        "/items/0",
        plan("vtol", land()),
        plan("multicopter", land()),
        _in_flight("vtol"),
        _in_flight("multicopter"),
        about="other types land in flight",
    ),
    Case(
        "landing.twice",
        "/items/3",
        plan("multicopter", takeoff(), land(50), gripper(), RETURN),
        plan("multicopter", takeoff(), land(50), gripper(), waypoint(50), RETURN),
    ),
]

VTOL_CASES = [
    Case(
        "vtol.items_only_on_vtol",
        "/items/1",
        multicopter(transition("fixed_wing"), waypoint()),
        vtol(transition("multicopter"), waypoint(300)),
    ),
    Case(
        "vtol.transition_on_ground",
        "/items/2",
        vtol(land(300), transition("fixed_wing"), waypoint(200)),
        vtol(land(300), waypoint(200), transition("fixed_wing"), waypoint(100)),
    ),
    Case(
        "vtol.transition_without_effect",
        "/items/1/to",
        vtol(transition("fixed_wing"), waypoint(300)),
        vtol(waypoint(300)),
    ),
    Case(
        "vtol.return_to_landing",
        "/items/2",
        vtol(waypoint(300)),
        vtol(waypoint(300)),
        facts("vtol", RTL_TYPE=1),
        facts("vtol", RTL_TYPE=0),
    ),
    Case(
        "vtol.return_to_landing",
        "/items/1",
        vtol(land(300), waypoint(200)),
        vtol(land(300), waypoint(200)),
        facts("vtol", RTL_TYPE=3),
        facts("vtol", RTL_TYPE=5),
        about="the first landing is the mission landing",
    ),
    Case(
        "vtol.return_to_landing",
        "/items/2",
        vtol(waypoint(300)),
        plan("multicopter", takeoff(), waypoint(), land()),
        None,
        facts(RTL_TYPE=1),
        about="the default of the airframe, and a vehicle that does not fly on its wing",
    ),
]

FIXED_WING_CASES = [
    Case(
        "loiter.radius_too_small",
        "/items/1/radius_m",
        fixed_wing(loiter(radius_m=-20), gripper("moving")),
        fixed_wing(loiter(radius_m=-40), gripper("moving")),
    ),
    Case(
        "loiter.radius_too_small",
        "/items/1",
        fixed_wing(loiter()),
        fixed_wing(loiter()),
        wrong_facts=facts("fixed_wing", NAV_LOITER_RAD=10),
        right_facts=facts("fixed_wing"),
        about="the vehicle's own radius",
    ),
    Case(
        "loiter.radius_too_small",
        "/items/1/radius_m",
        fixed_wing(loiter(radius_m=30), cruise_speed_m_s=19),
        multicopter(loiter(radius_m=1)),
        about="at this speed; a multicopter hovers",
    ),
    Case(
        "loiter.radius_too_small",
        "/items/2/approach",
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300, radius_m=1)),
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300)),
        about="of a landing",
    ),
    Case(
        "fixed_wing.approach_below_landing",
        "/items/2/approach",
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300, altitude_m=-5)),
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300)),
    ),
    Case(
        "fixed_wing.landing_inside_circle",
        "/items/2/approach",
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(0, 50)),
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(0, 310)),
    ),
    Case(
        "fixed_wing.glide_too_steep",
        "/items/2/approach",
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(0, 230)),
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(0, 240)),
        about="FW_LND_ANG + 0.1 degrees is a glide of 223 m",
    ),
    Case(
        "fixed_wing.glide_too_steep",
        "/items/2/approach",
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300)),
        plan("fixed_wing", wing_takeoff(), waypoint(400, 300), _approach(80, 300)),
        facts("fixed_wing", FW_LND_ANG=3),
        facts("fixed_wing", FW_LND_ANG=4),
        about="the vehicle's own angle",
    ),
    Case(
        "fixed_wing.landing_not_last",
        "/items/1",
        plan("fixed_wing", wing_takeoff(), land(800), waypoint(400), land()),
        WING_FLIGHT,
    ),
    Case(
        "fixed_wing.return_does_not_land",
        "/items/2",
        plan("fixed_wing", wing_takeoff(), waypoint(400), RETURN),
        WING_FLIGHT,
    ),
    Case(
        "landing.approach_ignored",
        "/items/2/approach",
        plan("multicopter", takeoff(), waypoint(), _approach(0, 300)),
        plan("multicopter", takeoff(), waypoint(), land()),
    ),
    Case(
        "fixed_wing.leg_too_short",
        "/items/2",
        fixed_wing(waypoint(400), waypoint(450, 0, 40)),
        fixed_wing(waypoint(400), waypoint(500, 0, 40)),
    ),
]

COMMAND_CASES = [
    Case(
        "loiter.turns_unsupported",
        "/items/1/kind",
        fixed_wing(loiter("turns", turns=2)),
        fixed_wing(loiter("time")),
    ),
    Case(
        "commands.never_flown",
        "/items/1",
        plan("multicopter", takeoff(), RETURN, waypoint(), land()),
        plan("multicopter", takeoff(), waypoint(), RETURN),
        about="after a return",
    ),
    Case(
        "commands.never_flown",
        "/items/1/kind",
        multicopter(loiter("unlimited")),
        multicopter(loiter("time")),
        about="after an endless loiter",
    ),
    Case(
        "delay.does_not_stop",
        "/items/2",
        fixed_wing(waypoint(400), delay()),
        fixed_wing(waypoint(400), loiter("time", 600)),
    ),
    Case(
        "jump.target",
        "/items/2/target",
        multicopter(waypoint(id="a"), _jump("b")),
        multicopter(waypoint(id="a"), waypoint(50), _jump("a")),
        about="nowhere",
    ),
    Case(
        "jump.target",
        "/items/1/target",
        multicopter(_jump("a"), waypoint(id="a")),
        multicopter(waypoint(id="a"), waypoint(50), _jump("a")),
        about="forward",
    ),
    Case(
        "jump.target",
        "/items/2/target",
        plan("multicopter", takeoff(id="up"), waypoint(), _jump("up"), RETURN),
        plan("multicopter", takeoff(), waypoint(id="up"), _jump("up"), RETURN),
        about="to no place",
    ),
    Case(
        "jump.over_drop",
        "/items/3/target",
        multicopter(waypoint(id="a"), gripper(), _jump("a")),
        multicopter(waypoint(id="a"), _jump("a"), waypoint(50), gripper()),
    ),
    Case(
        "jump.nested",
        "/items/5",
        multicopter(waypoint(id="a"), waypoint(50, id="b"), waypoint(60), _jump("b"), _jump("a")),
        multicopter(waypoint(id="a"), waypoint(50, id="b"), _jump("a"), waypoint(60, id="c"), _jump("c")),
    ),
    Case(
        "jump.not_predicted",
        "/items/7/repeats",
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 1000)),
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 800)),
    ),
    Case(
        "jump.limit_not_judged",
        "/items/7/repeats",
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 1000), limits={"max_duration_s": 86_400}),
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 1000)),
    ),
    Case(
        "jump.limit_not_judged",
        "/items/7/repeats",
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 1000)),
        multicopter(waypoint(id="a"), *[waypoint(50)] * 5, _jump("a", 1000)),
        replace(facts(), performance=Performance(battery_percent_per_min=0.001)),
        replace(facts(), performance=Performance(payload_max_kg=2.0)),
        about="of a battery",
    ),
]
