"""Cases of the rules about payload, battery and wind."""

from __future__ import annotations

from dataclasses import replace

from app.domain.prediction import Wind
from app.domain.vehicle.performance import Performance
from app.domain.vehicle.state import VehicleProfile
from tests.support.plan_pieces import (
    RETURN,
    airship,
    change_speed,
    facts,
    fixed_wing,
    gripper,
    multicopter,
    plan,
    takeoff,
    vtol,
    waypoint,
    winch,
)
from tests.support.rule_case import Case

SMALL = Performance(payload_max_kg=2.0, battery_percent_per_min=4.0)
FAR = multicopter(waypoint(2000), gripper())
"""Fifteen minutes: 60 % at 4 % a minute."""


def declared(performance: Performance = SMALL, charge: float | None = 100.0, **parameters: float) -> VehicleProfile:
    return replace(facts(**parameters), performance=performance, battery_percent=charge)


PAYLOAD_CASES = [
    Case(
        "payload.too_heavy",
        "/items/2/mass_kg",
        multicopter(waypoint(), gripper(mass_kg=2.1)),
        multicopter(waypoint(), gripper(mass_kg=2.0)),
        declared(),
        declared(),
    ),
    Case(
        "payload.too_heavy",
        "/items/2/mass_kg",
        multicopter(waypoint(), gripper(mass_kg=1.5), winch(mass_kg=0.4)),
        multicopter(waypoint(), gripper(mass_kg=1.5), winch(mass_kg=0.4)),
        declared(Performance(payload_max_kg=1.8)),
        declared(Performance(payload_max_kg=1.9)),
        about="both devices together",
    ),
    Case(
        "payload.too_heavy",
        "/items/4/mass_kg",
        multicopter(waypoint(), gripper(mass_kg=1), waypoint(200), gripper(action="grab", mass_kg=3)),
        multicopter(waypoint(), gripper(mass_kg=1), waypoint(200), gripper(action="grab", mass_kg=2)),
        declared(),
        declared(),
        about="taken on the way",
    ),
    Case(
        "payload.mass_unknown",
        "/items/2",
        multicopter(waypoint(), gripper()),
        multicopter(waypoint(), gripper(mass_kg=1)),
        declared(),
        declared(),
    ),
    Case(
        "payload.limit_unknown",
        "/items/2/mass_kg",
        multicopter(waypoint(), gripper(mass_kg=1)),
        multicopter(waypoint(), gripper(mass_kg=1)),
        facts(),
        declared(),
    ),
]
BATTERY_CASES = [
    Case("battery.reserve_at_home", "/items/3", FAR, FAR, declared(charge=70.0), declared(charge=90.0)),
    Case(
        "battery.reserve_at_home",
        "/items/3",
        multicopter(waypoint(2000), gripper(), limits={"min_battery_percent": 60}),
        multicopter(waypoint(2000), gripper(), limits={"min_battery_percent": 20}),
        declared(),
        declared(),
        about="the plan's own",
    ),
    Case(
        "battery.reserve_at_home",
        "/items/3",
        FAR,
        FAR,
        declared(BAT_CRIT_THR=0.5, COM_LOW_BAT_ACT=3),
        declared(BAT_CRIT_THR=0.5, COM_LOW_BAT_ACT=0),
        about="where the vehicle acts by itself",
    ),
    Case(
        "battery.reserve_at_home",
        "/items/3",
        FAR,
        FAR,
        declared(Performance(battery_capacity_wh=100.0, cruise_w=400.0)),
        declared(Performance(battery_capacity_wh=200.0, cruise_w=400.0)),
        about="in watts",
    ),
    Case(
        "battery.reserve_at_drop",
        "/items/2",
        multicopter(waypoint(1000), gripper(hold_s=600)),
        multicopter(waypoint(1000), gripper(hold_s=30)),
        declared(charge=60.0),
        declared(charge=60.0),
    ),
    Case(
        "battery.reserve_at_drop",
        "/items/2",
        multicopter(waypoint(1500), gripper(hold_s=300), waypoint(300), contingency={"on_drop_failure": "return"}),
        multicopter(waypoint(1500), gripper(hold_s=30), waypoint(300), contingency={"on_drop_failure": "return"}),
        declared(charge=75.0),
        declared(charge=75.0),
        about="the return",
    ),
    Case("battery.rate_unknown", "", FAR, FAR, facts(), declared()),
    Case("battery.charge_unknown", "", FAR, FAR, declared(charge=None), declared()),
    Case("battery.no_action", "", FAR, FAR, declared(), declared(COM_LOW_BAT_ACT=3)),
]
WIND_CASES = [
    Case(
        "wind.too_strong",
        "/items/0",
        fixed_wing(waypoint(400)),
        fixed_wing(waypoint(400)),
        wrong_wind=Wind(north_m_s=15.0),
        right_wind=Wind(north_m_s=12.0),
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        airship(waypoint(400)),
        multicopter(waypoint(400)),
        wrong_wind=Wind(east_m_s=5.0),
        right_wind=Wind(east_m_s=5.0),
        about="an airship",
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        multicopter(waypoint(400)),
        multicopter(waypoint(400)),
        wrong_wind=Wind(east_m_s=12.0),
        right_wind=Wind(east_m_s=11.9),
        about="a multicopter",
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        multicopter(waypoint(400)),
        multicopter(waypoint(400)),
        facts(MPC_XY_VEL_MAX=4),
        facts(MPC_XY_VEL_MAX=4),
        wrong_wind=Wind(east_m_s=12.0),
        right_wind=Wind(east_m_s=11.9),
        about="a low limit of the ground speed is none of the airspeed",
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        multicopter(waypoint(400)),
        multicopter(waypoint(400)),
        facts(MPC_XY_VEL_MAX=15),
        facts(MPC_XY_VEL_MAX=15),
        wrong_wind=Wind(east_m_s=15.0),
        right_wind=Wind(east_m_s=14.9),
        about="a multicopter that is faster than usual",
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        vtol(waypoint(400)),
        vtol(waypoint(400)),
        wrong_wind=Wind(east_m_s=12.5),
        right_wind=Wind(east_m_s=11.0),
        about="a VTOL that takes off",
    ),
    Case(
        "wind.too_strong",
        "/items/3",
        plan("airship", change_speed(7), takeoff(20), waypoint(400), RETURN),
        plan("airship", change_speed(7), takeoff(20), waypoint(400), waypoint(0, 0)),
        wrong_wind=Wind(east_m_s=5.0),
        right_wind=Wind(east_m_s=5.0),
        about="a return at its own speed",
    ),
    Case(
        "wind.too_strong",
        "/items/0",
        airship(waypoint(400)),
        airship(waypoint(400)),
        facts("airship", MPC_XY_VEL_MAX=3),
        facts("airship", MPC_XY_VEL_MAX=3),
        wrong_wind=Wind(east_m_s=4.0),
        right_wind=Wind(east_m_s=3.9),
        about="an airship, which no MPC_XY_VEL_MAX limits",
    ),
    Case(
        "wind.strong",
        "/items/0",
        multicopter(waypoint(400)),
        multicopter(waypoint(400)),
        wrong_wind=Wind(east_m_s=5.1),
        right_wind=Wind(east_m_s=5.0),
    ),
    Case(
        "wind.strong",
        "/items/1",
        multicopter(waypoint(400, speed_m_s=8)),
        multicopter(waypoint(400, speed_m_s=7)),
        wrong_wind=Wind(east_m_s=5.0),
        right_wind=Wind(east_m_s=5.0),
        about="against a fast leg",
    ),
    Case(
        "wind.strong",
        "/items/0",
        multicopter(waypoint(400)),
        multicopter(waypoint(400)),
        facts(MPC_XY_VEL_MAX=4),
        facts(MPC_XY_VEL_MAX=10),
        wrong_wind=Wind(east_m_s=4.0),
        right_wind=Wind(east_m_s=4.0),
        about="above a low limit of the ground speed",
    ),
    Case(
        "wind.strong",
        "/items/0",
        vtol(waypoint(400)),
        vtol(waypoint(400)),
        wrong_wind=Wind(east_m_s=6.0),
        right_wind=Wind(east_m_s=5.0),
        about="a VTOL that takes off",
    ),
]
