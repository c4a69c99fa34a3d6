"""Cases of the rules about drops: where they stand, and whether the vehicle can stop there."""

from __future__ import annotations

from tests.unit.domain.plan_pieces import (
    RETURN,
    airship,
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
    winch,
    wing_takeoff,
)
from tests.unit.domain.rules.case import Case

SPEED = {"type": "change_speed", "speed_m_s": 4}
DELIVERY = multicopter(waypoint(), gripper())
PASS = gripper("moving")

POSITION_CASES = [
    Case(
        "gripper.must_follow_waypoint",
        "/items/1",
        multicopter(gripper(), waypoint()),
        DELIVERY,
        about="a takeoff is no place to drop",
    ),
    Case(
        "gripper.must_follow_waypoint",
        "/items/3",
        vtol(waypoint(200), transition("multicopter"), gripper()),
        vtol(transition("multicopter"), waypoint(200), gripper()),
        about="a transition between",
    ),
    Case(
        "gripper.must_follow_waypoint",
        "/items/0",
        plan("rover", gripper("moving"), waypoint(30, 0, 0)),
        rover(waypoint(30, 0, 0), gripper("moving")),
        about="first of all",
    ),
    Case(
        "winch.must_follow_waypoint",
        "/items/1",
        multicopter(winch(), waypoint()),
        multicopter(waypoint(), delay(), SPEED, winch()),
        about="delay and speed may stand between",
    ),
    Case(
        "gripper.released_twice",
        "/items/4",
        multicopter(waypoint(), gripper(), waypoint(50), gripper()),
        multicopter(waypoint(), gripper(), waypoint(50), gripper(action="grab"), waypoint(), gripper()),
    ),
    Case(
        "drop.firmware_too_old",
        "/items/2",
        multicopter(waypoint(), gripper(mode="embedded")),
        multicopter(waypoint(), gripper(mode="embedded")),
        facts(firmware=(1, 13, 3)),
        facts(firmware=(1, 14, 0)),
        about="embedded in a mission",
    ),
    Case(
        "drop.firmware_too_old",
        "/items/2",
        multicopter(waypoint(), winch()),
        multicopter(waypoint(), gripper(mode="supervised")),
        facts(firmware=(1, 13, 3)),
        facts(firmware=(1, 13, 3)),
        about="a supervised drop is no item",
    ),
    Case("gripper.instance_ignored", "/items/2/instance", multicopter(waypoint(), gripper(instance=2)), DELIVERY),
    Case(
        "gripper.not_enabled",
        "/items/2",
        DELIVERY,
        DELIVERY,
        facts(PD_GRIPPER_TYPE=-1),
        facts(PD_GRIPPER_TYPE=0),
    ),
    Case("winch.not_executed", "/items/2", multicopter(waypoint(), winch()), DELIVERY),
    Case(
        "gripper.supervised_grab",
        "/items/2/mode",
        multicopter(waypoint(), gripper(action="grab", mode="supervised")),
        multicopter(waypoint(), gripper(action="grab")),
    ),
    Case(
        "winch.supervised",
        "/items/2/mode",
        multicopter(waypoint(), winch(mode="supervised")),
        multicopter(waypoint(), winch()),
    ),
    Case(
        "landed_drop.rtl_type",
        "/items/2",
        multicopter(land(50), gripper(), waypoint()),
        multicopter(land(50), gripper(), waypoint()),
        facts(RTL_TYPE=1),
        facts(RTL_TYPE=5),
    ),
    Case(
        "landed_drop.fixed_wing",
        "/items/2",
        plan("fixed_wing", wing_takeoff(), land(400), gripper(), waypoint(), land()),
        fixed_wing(waypoint(400), PASS),
    ),
    Case(
        "drop.command_timeout",
        "/items/2",
        multicopter(waypoint(), gripper(mode="embedded")),
        DELIVERY,
        facts(MIS_COMMAND_TOUT=3),
        facts(MIS_COMMAND_TOUT=3),
    ),
    Case(
        "drop.offset_not_reachable",
        "/items/2/max_offset_m",
        fixed_wing(waypoint(400), gripper("moving", max_offset_m=30)),
        fixed_wing(waypoint(400), gripper("moving", max_offset_m=40)),
        about="a plane at 15 m/s switches 33.6 m early",
    ),
    Case(
        "drop.offset_not_reachable",
        "/items/2/max_offset_m",
        fixed_wing(waypoint(400), gripper("moving", max_offset_m=60)),
        fixed_wing(waypoint(400), gripper("moving", max_offset_m=60)),
        facts("fixed_wing", firmware=(1, 13, 3)),
        facts("fixed_wing", firmware=(1, 14, 0)),
        about="older firmware 71.6 m early",
    ),
]

ASKS = {"consent": "operator"}
CONSENT_CASES = [
    Case(
        "drop.consent_unsupervised",
        "/items/2/consent",
        multicopter(waypoint(), gripper(mode="embedded", **ASKS)),
        multicopter(waypoint(), gripper(**ASKS)),
        about="embedded",
    ),
    Case(
        "drop.consent_unsupervised",
        "/items/2/consent",
        multicopter(waypoint(), gripper(action="grab", **ASKS)),
        multicopter(waypoint(), gripper(action="grab")),
        about="a grab",
    ),
    Case(
        "drop.consent_unsupervised",
        "/items/2/consent",
        fixed_wing(waypoint(400), gripper("moving", **ASKS)),
        rover(waypoint(30, 0, 0), gripper(**ASKS)),
        about="a fixed wing cannot wait for anybody",
    ),
    Case(
        "drop.consent_hold_too_short",
        "/items/2/hold_s",
        multicopter(waypoint(), gripper(hold_s=30, consent_timeout_s=26, **ASKS)),
        multicopter(waypoint(), gripper(hold_s=30, consent_timeout_s=25, **ASKS)),
    ),
    Case(
        "drop.consent_hold_too_short",
        "/items/2/hold_s",
        multicopter(waypoint(), gripper(hold_s=9, **ASKS)),
        multicopter(waypoint(hold_s=10), gripper(hold_s=9, **ASKS)),
        about="the longer hold of its waypoint counts",
    ),
    Case(
        "drop.consent_timeout_unused",
        "/items/2/consent_timeout_s",
        multicopter(waypoint(), gripper(consent_timeout_s=20)),
        multicopter(waypoint(), gripper(consent_timeout_s=20, **ASKS)),
    ),
]

BRAKING_CASES = [
    Case(
        "braking.cannot_stop",
        "/items/2/release_motion",
        fixed_wing(waypoint(400), gripper("stopped")),
        fixed_wing(waypoint(400), gripper("moving")),
        about="a fixed wing passes",
    ),
    Case(
        "braking.cannot_stop",
        "/items/2/release_motion",
        fixed_wing(loiter(), gripper("stopped")),
        fixed_wing(loiter(), gripper("moving")),
        about="a fixed wing circles",
    ),
    Case(
        "braking.cannot_stop",
        "/items/2/release_motion",
        vtol(waypoint(300), gripper("stopped")),
        vtol(transition("multicopter"), waypoint(300), gripper("stopped")),
        about="a VTOL takes off into fixed-wing flight",
    ),
    Case(
        "braking.cannot_stop",
        "/items/4/release_motion",
        vtol(transition("multicopter"), transition("fixed_wing"), waypoint(300), gripper("stopped")),
        vtol(transition("multicopter"), transition("fixed_wing"), waypoint(300), gripper("moving")),
        about="a VTOL that went back to its wings",
    ),
    Case(
        "braking.cannot_stop",
        "/items/2/release_motion",
        airship(waypoint(), gripper("stopped")),
        airship(waypoint(), gripper("moving")),
        about="an airship drifts",
    ),
    Case(
        "braking.rover_needs_delay",
        "/items/1",
        rover(waypoint(30, 0, 0), gripper("stopped", mode="embedded")),
        rover(waypoint(30, 0, 0), delay(), gripper("stopped", mode="embedded")),
        about="a rover passes its waypoint",
    ),
    Case(
        "braking.moving_but_waits",
        "/items/2/release_motion",
        multicopter(waypoint(hold_s=5), gripper("moving")),
        multicopter(waypoint(), gripper("moving")),
        about="a multicopter told to hold",
    ),
    Case(
        "braking.moving_but_waits",
        "/items/2/release_motion",
        rover(waypoint(30, 0, 0), delay(), gripper("moving")),
        rover(waypoint(30, 0, 0), gripper("moving")),
        about="a rover told to wait",
    ),
    Case(
        "braking.supervised_needs_hold",
        "/items/2/mode",
        fixed_wing(waypoint(400), gripper("moving", mode="supervised")),
        fixed_wing(waypoint(400), gripper("moving", mode="embedded")),
    ),
    Case(
        "braking.supervised_needs_stop",
        "/items/2/release_motion",
        multicopter(waypoint(), gripper("moving", mode="supervised")),
        multicopter(waypoint(), gripper("stopped", mode="supervised")),
    ),
    Case(
        "braking.radius_too_large",
        "/items/1/acceptance_radius_m",
        multicopter(waypoint(acceptance_radius_m=5), gripper()),
        multicopter(waypoint(acceptance_radius_m=0.5), gripper()),
    ),
    Case(
        "braking.hold_ignored",
        "/items/1/hold_s",
        fixed_wing(waypoint(400, hold_s=5)),
        plan("multicopter", takeoff(), waypoint(hold_s=5), RETURN),
    ),
]
