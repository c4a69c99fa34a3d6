"""What is predicted is what the simulated vehicles fly, on simulated time; `make bench-prediction` flies all plans."""

from __future__ import annotations

import json

import pytest

from app.domain.plan import Plan, parse_plan
from bench.predicted_flight import predicted_and_flown
from tests.support.paths import PLANS
from tests.support.plan_pieces import (
    RETURN,
    at,
    change_speed,
    gripper,
    land,
    loiter,
    multicopter,
    plan,
    takeoff,
    waypoint,
)


@pytest.mark.parametrize(
    ("name", "airframe", "wind_m_s"),
    [
        ("rover-drop", "rover", (0.0, 0.0)),
        ("fixed-wing-pass", "plane", (0.0, 5.0)),
        ("multicopter-landed", "quad", (0.0, 0.0)),
        ("vtol-hover-drop", "vtol", (0.0, 0.0)),
        ("vtol-hover-drop", "vtol", (5.0, 0.0)),
    ],
)
def test_times_and_releases_are_as_predicted(name: str, airframe: str, wind_m_s: tuple[float, float]) -> None:
    """Item times within 15 %, releases within 3 m, of a wing within 15 % of the lead."""
    example = parse_plan(json.loads((PLANS / f"{name}.json").read_text(encoding="utf-8")))
    flown = predicted_and_flown(example, airframe, wind_m_s=wind_m_s)
    assert not flown.failures
    assert flown.drops
    assert flown.flown_s == pytest.approx(flown.predicted_s, rel=0.1)


def test_what_a_hovering_vtol_in_a_crosswind_does_is_named_as_unsure() -> None:
    example = parse_plan((PLANS / "vtol-hover-drop.json").read_bytes())
    assert not predicted_and_flown(example, "vtol", wind_m_s=(0.0, 5.0)).failures


def test_the_vehicles_own_parameters_are_what_is_predicted_with() -> None:
    """A quad that flies at 3 m/s, climbs at 1 m/s, lands slower and returns lower."""
    params = {"MPC_XY_CRUISE": 3.0, "MPC_Z_V_AUTO_UP": 1.0, "MPC_LAND_SPEED": 0.5, "RTL_RETURN_ALT": 20.0}
    example = parse_plan(json.loads((PLANS / "multicopter-embedded.json").read_text(encoding="utf-8")))
    assert not predicted_and_flown(example, "quad", params=params).failures


@pytest.mark.parametrize("duration_s", [0, 3, 20])
@pytest.mark.parametrize("mode", ["embedded", "supervised"])
def test_a_stopped_drop_after_a_loiter_is_released_at_its_point(duration_s: float, mode: str) -> None:
    """The loiter itself ends at the vehicle's acceptance radius, 10 m before."""
    flown = predicted_and_flown(multicopter(loiter(duration_s=duration_s), gripper(mode=mode)), "quad")
    assert not flown.failures
    assert flown.drops[0].apart_m == pytest.approx(0.0, abs=1.5)


def test_a_photo_and_a_speed_before_a_drop_with_an_alternate_are_flown() -> None:
    locker = at(100, 80, relative_altitude_m=30)
    between = ({"type": "photo", "id": "before"}, {"type": "change_speed", "speed_m_s": 3, "id": "slow"})
    flight = multicopter(waypoint(), *between, gripper(alternate=locker), waypoint(100, 60))
    flown = predicted_and_flown(flight, "quad")
    times = {row.item_id: row for row in flown.items[:-1]}
    assert all(row.is_within for row in times.values())
    assert times["before"].flown_s is not None
    assert times["slow"].flown_s is not None
    assert len(flown.drops) == 1


TO_GARDEN = plan("multicopter", takeoff(), waypoint(120, 0, 15), land(160, 0), waypoint(100, 120, 20), RETURN)
BY_CORNERS = (waypoint(150, 0, 15), waypoint(150, 120, 15), waypoint(300, 120, 25, hold_s=2))
IN_TWO_STATES = plan("vtol", takeoff(30, **at(60, 0)), waypoint(400, 0), waypoint(400, 300), RETURN)


@pytest.mark.parametrize(
    ("flight", "airframe", "rtl_type"),
    [
        (multicopter(*BY_CORNERS), "quad", 2),
        (multicopter(*BY_CORNERS, cruise_speed_m_s=2), "quad", 2),
        (TO_GARDEN, "quad", 4),
        (IN_TWO_STATES, "vtol", 2),
    ],
    ids=["back by its corners", "back as slowly", "on to its landing", "a wing"],
)
def test_a_return_along_the_mission_is_as_long_as_predicted(flight: Plan, airframe: str, rtl_type: int) -> None:
    """The vehicle counts the items back, so that the return has no time of its own: the whole flight is compared."""
    flown = predicted_and_flown(flight, airframe, params={"RTL_TYPE": rtl_type, "MIS_TKO_LAND_REQ": 0})
    returns_s = flown.items[-1].predicted_s
    assert flown.flown_s == pytest.approx(flown.predicted_s, abs=0.1 * returns_s)


ON_A_WING = plan("vtol", takeoff(30, **at(60, 0)), waypoint(600, 0, 30, speed_m_s=18), RETURN)


@pytest.mark.parametrize(
    ("flight", "airframe"),
    [
        (multicopter(waypoint(300, 0, 15, speed_m_s=11)), "quad"),
        (multicopter(waypoint(200, 0, 15), cruise_speed_m_s=2), "hexa"),
        (plan("rover", waypoint(40, 0), change_speed(0.5), RETURN), "rover"),
        (ON_A_WING, "vtol"),
    ],
    ids=["fast", "slow all the way", "a rover", "a wing"],
)
def test_a_direct_return_is_flown_at_the_vehicles_own_speed(flight: Plan, airframe: str) -> None:
    """PX4 forgets the requested speed as it enters Return."""
    flown = predicted_and_flown(flight, airframe, params={"RTL_TYPE": 0, "MIS_TKO_LAND_REQ": 0})
    assert not flown.failures


@pytest.mark.parametrize(
    "flight",
    [
        plan("multicopter", change_speed(2), takeoff(), waypoint(100, 0, 15), RETURN),
        multicopter(waypoint(60, 0, 15), land(80), change_speed(2), waypoint(160, 0, 15)),
    ],
    ids=["before the takeoff", "after a landing"],
)
def test_a_speed_that_is_requested_on_the_ground_counts_in_the_air(flight: Plan) -> None:
    """The first item ends before the flight begins to be measured."""
    flown = predicted_and_flown(flight, "quad", params={"RTL_TYPE": 0})
    assert all(item.is_within for item in flown.items[1:])
    assert flown.flown_s == pytest.approx(flown.predicted_s, rel=0.1)


@pytest.mark.parametrize("wind_m_s", [(-6.0, 0.0), (0.0, 8.0)], ids=["headwind", "crosswind"])
def test_a_multicopter_in_strong_wind_is_as_unsure_as_it_is_slow(wind_m_s: tuple[float, float]) -> None:
    """The quad flies 3.8 m/s against 6 m/s, and 1.8 m/s against 8 m/s, home from the east."""
    flight = multicopter(waypoint(100, 0, 15, hold_s=5), waypoint(100, 120, 15, hold_s=2))
    flown = predicted_and_flown(flight, "quad", wind_m_s=wind_m_s)
    assert not flown.failures
    assert any(item.uncertainty_s > 0.0 for item in flown.items)
