"""A VTOL in hover and between its states, as recorded (12, 27)."""

from __future__ import annotations

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.prediction import Wind, predict, vtol
from app.domain.prediction.motion import FlightContext, MotionState
from app.domain.vehicle.state import VehicleType
from tests.support.plan_pieces import HOME, at, change_speed, land, plan, takeoff, transition, waypoint
from tests.support.plan_pieces import vtol as vtol_plan

FACTS = default_facts(VehicleType.VTOL)
FLIGHT = FlightContext(FACTS, HOME)


def test_a_transition_after_a_hover_leg_takes_its_turn_too() -> None:
    """Flown 5.4 and 5.5 s, 4.0 had been predicted."""
    moving = MotionState((0.0, 0.0), 30.0, 5.0, 0.0, 0.0)
    assert vtol.to_wing(FLIGHT, moving, (200.0, 0.0)).duration_s == pytest.approx(5.45, abs=1.0)


@pytest.mark.parametrize(("speed_m_s", "flown_s"), [(1.8, 2.2), (1.2, 2.6)])
def test_a_transition_straight_ahead_takes_what_the_pusher_takes(speed_m_s: float, flown_s: float) -> None:
    ahead = vtol.to_wing(FLIGHT, MotionState((0.0, 0.0), 30.0, speed_m_s, 0.0, 0.0), (0.0, 200.0))
    assert ahead.duration_s == pytest.approx(flown_s, abs=0.4)
    assert ahead.distance_m == pytest.approx(13.0, abs=3.0)


@pytest.mark.parametrize(("speed_m_s", "flown_s"), [(8.1, 0.4), (11.3, 0.8)])
def test_back_to_hover_ends_at_the_speed_of_hover(speed_m_s: float, flown_s: float) -> None:
    back = vtol.to_hover(FLIGHT, MotionState((0.0, 0.0), 30.0, speed_m_s, 0.0, 0.0))
    assert back.duration_s == pytest.approx(flown_s, abs=0.3)
    assert back.end.speed_m_s == pytest.approx(5.0)


@pytest.mark.parametrize(("asked_m_s", "flown_m_s"), [(8.0, 5.7), (12.0, 5.7), (4.0, 4.0)])
def test_a_vtol_hovers_no_faster_than_its_wing_lets_it(asked_m_s: float, flown_m_s: float) -> None:
    assert vtol.hover_speed_m_s(FACTS, asked_m_s) == flown_m_s
    assert vtol.hover_speed_m_s(default_facts(VehicleType.MULTICOPTER), asked_m_s) == asked_m_s


def test_a_speed_set_on_the_wing_does_not_count_in_hover_nor_the_other_way() -> None:
    fast, slow = waypoint(300, speed_m_s=11), waypoint(400, speed_m_s=3)
    on_the_wing, hovering = waypoint(700), waypoint(800)
    plan = vtol_plan(
        fast,
        transition("multicopter"),
        slow,
        transition("fixed_wing"),
        on_the_wing,
        transition("multicopter"),
        hovering,
    )
    flown = [entry.ground_speed_m_s for entry in predict(plan, FACTS).entries if entry.type == "waypoint"]
    trim, cruise = (FACTS.parameters[name] for name in ("FW_AIRSPD_TRIM", "MPC_XY_CRUISE"))
    assert flown == [11.0, 3.0, trim, cruise]


def test_a_speed_that_is_set_before_the_takeoff_ends_with_its_transition() -> None:
    flight = plan("vtol", change_speed(4), takeoff(30, **at(60, 0)), waypoint(400), transition("multicopter"), land())
    flown = [entry.ground_speed_m_s for entry in predict(flight, FACTS).entries if entry.type == "waypoint"]
    assert flown == [FACTS.parameters["FW_AIRSPD_TRIM"]]


def test_in_wind_it_is_unsure_when_a_hovering_vtol_reaches_a_heading() -> None:
    flight = plan("vtol", takeoff(30), waypoint(250), transition("multicopter"), waypoint(400), land(0, 0))
    own = default_facts(flight.vehicle_type)
    calm, windy = (predict(flight, own, wind).entries for wind in (Wind(), Wind(east_m_s=5.0)))
    more_s = [there.uncertainty_s - here.uncertainty_s for here, there in zip(calm, windy, strict=True)]
    assert more_s == [vtol.HEADING_TIMEOUT_S, 0.0, 0.0, vtol.HEADING_TIMEOUT_S, vtol.HEADING_TIMEOUT_S]


def test_in_a_tail_wind_it_brakes_by_its_pitch() -> None:
    flight = plan("vtol", takeoff(30), waypoint(250), transition("multicopter"), waypoint(400), land(0, 0))
    own = default_facts(flight.vehicle_type)
    calm, pushed = (predict(flight, own, wind).entries[2].duration_s for wind in (Wind(), Wind(north_m_s=5.0)))
    assert pushed > calm + 1.0
