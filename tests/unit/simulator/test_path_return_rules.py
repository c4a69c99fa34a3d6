"""A return on to the mission landing, without the flight: each stage, what ends it, and what is said."""

from __future__ import annotations

import math

import pytest

from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, VtolState
from tests.support.along_mission import GARDEN, HOME_UP_M, LOITER_DOWN, PLANS, TO_HOVER, WAIT, Along
from tests.support.simulated_vehicle import RELEASE, Plan, land, takeoff, waypoint


def test_it_begins_as_a_mission_that_has_reached_nothing_yet() -> None:
    along = Along()
    assert (along.air.result.finished, along.air.result.seq_reached, along.seq) == (False, -1, 1)
    assert (along.air.said, along.air.events) == (["Executing Mission"], [("mission_execute",)])


def test_a_position_is_passed_with_its_own_radius_and_without_its_hold() -> None:
    along = Along()
    assert along.flies == (SetpointKind.POSITION, (100, 0), 15.0)
    assert along.setpoint.acceptance_radius_m == 4.0
    assert along.setpoint.previous == (0.0, 0.0)
    assert along.setpoint.next == pytest.approx((100.0, 100.0), abs=0.1)
    assert along.at(95.9, 0, 15).seq == 1
    assert along.at(96.1, 0, 13).seq == 1, "not at its height"
    assert along.at(96.1, 0, 15).seq == 3
    assert along.at(96.1, 0, 15, cycles=9).seq == 3, "one at a time"
    assert along.air.result.seq_reached == 1
    assert along.flies == (SetpointKind.POSITION, (100, 100), 25.0)
    assert along.setpoint.previous == (96.1, 0.0)
    assert along.air.issued == []


def test_the_last_leg_knows_that_the_next_point_lands() -> None:
    along = Along(current=3)
    assert not along.setpoint.next_lands
    along.at(100, 100, 25)
    assert (along.seq, along.setpoint.next_lands) == (5, True)
    assert along.setpoint.next == pytest.approx(GARDEN, abs=0.1)


def test_from_an_item_without_a_position_it_goes_on_to_the_next_that_has_one() -> None:
    assert Along(current=4).seq == 5
    assert Along(current=4, from_mission=False, at=(90.0, 110.0, 30.0)).seq == 3, "unless it looks for the nearest"


@pytest.mark.parametrize(("plan", "kind"), [(LOITER_DOWN, SetpointKind.LOITER), (WAIT, SetpointKind.POSITION)])
@pytest.mark.parametrize("airframe", ["quad", "plane"])
def test_of_loiters_only_the_one_to_an_altitude_stays_one(airframe: str, plan: Plan, kind: SetpointKind) -> None:
    plans = [takeoff(15), plan, land(0, 200)]
    along = Along(airframe=airframe, plans=plans, at=(0.0, 0.0, 80.0))
    assert along.setpoint.kind is kind
    down = kind is SetpointKind.LOITER
    assert along.setpoint.up_m == (80.0 if airframe == "plane" and down else 30.0 + HOME_UP_M), "down on its orbit"
    if down:
        assert (along.setpoint.loiter_radius_m, along.setpoint.loiter_clockwise) == (70.0, False)
    if airframe == "plane" and down:
        assert along.at(900, 0, 60).seq == 1
        assert along.at(900, 0, 30).seq == 2
    else:
        assert along.at(900, 0, 30).seq == 2, "without its time"


def test_an_orbit_below_is_climbed_to() -> None:
    along = Along(airframe="plane", plans=[takeoff(15), LOITER_DOWN, land(0, 200)], at=(0.0, 0.0, 10.0))
    assert along.setpoint.up_m == 35.0


def test_a_multicopter_lands_from_over_the_landing_point() -> None:
    along = Along(current=5)
    along.at(0, 100, 25)
    assert along.seq == 6
    assert along.flies == (SetpointKind.POSITION, (0, 200), 25.0)
    assert along.at(0, 189.9, 25).flies[0] is SetpointKind.POSITION
    assert along.at(0, 190.1, 25).flies == (SetpointKind.LAND, (0, 200), 0.0)
    assert along.setpoint.previous is None
    assert along.air.result.seq_reached == 5


def test_from_below_it_climbs_to_the_landings_height_first() -> None:
    along = Along(current=6, plans=[*PLANS[:6], Plan(Cmd.NAV_LAND, *GARDEN, 8.0)], at=(0.0, 100.0, 7.0))
    assert along.flies == (SetpointKind.POSITION, (0, 200), 8.0)


@pytest.mark.parametrize(("airframe", "previous"), [("plane", (0.0, 100.0)), ("rover", None)])
def test_who_cannot_hover_lands_on_a_slope_from_where_it_is(
    airframe: str, previous: tuple[float, float] | None
) -> None:
    along = Along(current=6, airframe=airframe, at=(0.0, 100.0, 25.0))
    assert along.flies == (SetpointKind.LAND, (0, 200), 0.0)
    assert along.setpoint.previous == previous
    assert along.setpoint.approach_slope == pytest.approx(0.2, abs=1e-3)


def test_over_the_landing_point_there_is_no_slope() -> None:
    assert math.isnan(Along(current=6, airframe="plane", at=(0.0, 199.5, 25.0)).setpoint.approach_slope)
    assert not math.isnan(Along(current=6, airframe="plane", at=(0.0, 198.5, 25.0)).setpoint.approach_slope)


def test_a_vtol_on_its_wing_changes_back_over_the_landing_point_and_comes_back_to_it() -> None:
    along = Along(current=6, airframe="vtol", plans=[*PLANS[:6], land(*GARDEN, command=Cmd.NAV_VTOL_LAND)])
    assert along.at(0, 150, 30).air.issued == []
    along.at(0, 195, 30, cycles=3)
    assert along.air.issued == [TO_HOVER]
    along.air.status.vtol_state = VtolState.TRANSITION_TO_MC
    assert along.at(0, 230, 30).setpoint.kind is SetpointKind.POSITION
    along.air.status.vtol_state = VtolState.MC
    assert along.at(0, 230, 28, cycles=3).flies == (SetpointKind.POSITION, (0, 200), 28.0)
    assert along.at(0, 209, 28, cycles=2).setpoint.kind is SetpointKind.LAND
    assert along.air.issued == [TO_HOVER]


def test_it_ends_landed_with_a_word_once_and_the_landing_is_reached() -> None:
    along = Along(current=6, airframe="rover")
    along.air.run(along.path.step, 1.0)
    assert not along.air.result.finished
    along.air.land()
    along.air.place(0.0, 199.0, 0.0)
    along.air.run(along.path.step, 1.0)
    assert (along.air.result.finished, along.air.result.seq_reached) == (True, 6)
    assert along.setpoint.kind is SetpointKind.IDLE
    assert along.setpoint.point == (0.0, 199.0)
    assert along.air.said[1:] == ["Mission finished, landed"]
    assert along.air.events[1:] == [("mission_finished",)]
    along.air.store.clear(0)
    along.air.run(along.path.step, 1.0)
    assert len(along.air.said) == 2, "a mission that is cleared afterwards is none of its business"


def test_after_the_last_position_it_loiters_at_that_place_with_a_word() -> None:
    plans = [takeoff(15), waypoint(100, 0, 15, 0, 4), RELEASE]
    along = Along(plans=plans)
    along.at(99, 0, 15.5, cycles=3)
    assert along.flies == (SetpointKind.LOITER, (100, 0), 15), "setEndOfMissionItems: around the current setpoint"
    assert along.air.said[1:] == ["Mission finished, loitering"]
    assert along.air.events[1:] == [("mission_finished_loiter",)]
    assert (along.air.result.finished, along.air.result.seq_reached) == (True, 1)


@pytest.mark.parametrize("airframe", ["quad", "plane", "vtol"])
def test_from_another_mode_it_joins_at_the_nearest_position_a_plane_at_no_landing(airframe: str) -> None:
    along = Along(airframe=airframe, current=0, from_mission=False, at=(0.0, 190.0, 6.0))
    assert along.seq == (5 if airframe == "plane" else 6)
    high = Along(airframe=airframe, current=0, from_mission=False, at=(60.0, 0.0, 20.0))
    assert high.seq == 1


def test_on_to_the_landing_a_vtol_that_hovers_stays_as_it_is() -> None:
    along = Along(current=3, airframe="vtol")
    along.air.status.vtol_state = VtolState.MC
    assert along.at(100, 100, 25).seq == 5
    assert along.air.issued == []


def test_nearest_counts_the_height() -> None:
    plans = [takeoff(15), waypoint(100, 0, 90), waypoint(100, 40, 15), land(0, 200)]
    assert Along(plans=plans, from_mission=False, at=(100.0, 0.0, 20.0)).seq == 2


def test_without_any_position_that_is_ahead_it_goes_to_the_landing() -> None:
    plans = [takeoff(15), land(0, 200), RELEASE]
    along = Along(plans=plans, current=2)
    assert (along.seq, along.flies[1]) == (1, (0, 200))
