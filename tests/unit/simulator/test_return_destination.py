"""Where a return ends, by RTL_TYPE, with and without a landing in the mission and rally points."""

from __future__ import annotations

import pytest

from app.simulator.navigator.return_destination import ReturnDestination
from app.simulator.wire import Cmd
from tests.unit.simulator.cockpit import Cockpit, Plan, land, takeoff, waypoint

HOME, GARDEN, RALLY = (0.0, 0.0), (60.0, 0.0), (40.0, 30.0)


def chosen(rtl_type: int, *, garden: bool, rally: bool, north_m: float, seq: int = 1) -> tuple[float, float]:
    """By a vehicle on its way at north_m; its mission would land in the garden and fly on."""
    cockpit = Cockpit(params={"RTL_TYPE": rtl_type}, ready=False)
    cockpit.fly(3.0)
    if rally:
        assert cockpit.upload([Plan(5100, *RALLY, 15, (0, 0, 0, 0))], 2) == 0
    landing = [land(*GARDEN)] if garden else []
    cockpit.upload([takeoff(10), waypoint(20, 0, 10), waypoint(40, 0, 10), *landing, waypoint(80, 0, 10)])
    vehicle = cockpit.vehicle
    vehicle.state.body.north_m, vehicle.store.current_seq = north_m, seq
    return ReturnDestination(vehicle.context, vehicle.store).choose()


@pytest.mark.parametrize(
    ("rtl_type", "garden", "rally", "north_m", "place"),
    [
        (0, True, False, 50.0, HOME),  # the landing does not count
        (0, True, True, 50.0, RALLY),
        (0, False, True, 10.0, HOME),
        (1, True, False, 20.0, GARDEN),  # even when home is nearer
        (1, True, True, 25.0, RALLY),
        (1, False, False, 50.0, HOME),
        (2, True, True, 20.0, GARDEN),
        (2, False, True, 50.0, HOME),
        (3, True, True, 50.0, GARDEN),
        (3, True, True, 10.0, HOME),
        (4, False, True, 50.0, HOME),
        (5, True, True, 10.0, RALLY),
        (5, True, False, 50.0, HOME),
    ],
)
def test_a_return_ends_where_rtl_type_says(
    rtl_type: int, garden: bool, rally: bool, north_m: float, place: tuple[float, float]
) -> None:
    assert chosen(rtl_type, garden=garden, rally=rally, north_m=north_m) == pytest.approx(place, abs=0.1)


@pytest.mark.parametrize(("seq", "place"), [(1, HOME), (2, GARDEN), (3, GARDEN), (4, GARDEN)])
def test_type_4_counts_the_items_to_both(seq: int, place: tuple[float, float]) -> None:
    assert chosen(4, garden=True, rally=False, north_m=20.0, seq=seq) == pytest.approx(place, abs=0.1)


def test_a_return_flies_and_lands_there() -> None:
    cockpit = Cockpit(params={"RTL_TYPE": 1, "RTL_RETURN_ALT": 12.0, "NAV_ACC_RAD": 2.0})
    cockpit.start([takeoff(10), waypoint(20, 0, 10, 60, 1), land(*GARDEN)])
    cockpit.until(lambda: cockpit.vehicle.state.body.north_m > 10)
    cockpit.command(Cmd.NAV_RETURN_TO_LAUNCH)
    cockpit.until(lambda: not cockpit.armed)
    assert cockpit.distance_to(*GARDEN) < 1.0
