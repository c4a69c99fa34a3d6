"""A return back along the mission, or straight to its landing, without the flight; and missions that change."""

from __future__ import annotations

import pytest

from app.simulator.navigator.return_plan import Way
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, VtolState
from tests.support.along_mission import GARDEN, HOME, PLANS, TO_WING, Along
from tests.support.simulated_vehicle import RELEASE, Plan, do, land, takeoff, waypoint

# back -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("current", "first"), [(5, 4), (1, 0), (0, 0)])
def test_back_begins_with_the_item_before(current: int, first: int) -> None:
    assert Along(Way.REVERSE, current).seq == first


def test_back_from_another_mode_begins_with_the_nearest_and_without_any_with_the_first() -> None:
    assert Along(Way.REVERSE, 5, from_mission=False, at=(100.0, 10.0, 20.0)).seq == 1
    assert Along(Way.REVERSE, 1, plans=[RELEASE, RELEASE], from_mission=False).seq == 0


def test_back_a_command_is_given_with_its_parameters_and_does_not_detain() -> None:
    along = Along(Way.REVERSE, 5, plans=[*PLANS[:4], do(Cmd.DO_GRIPPER, 1, 0, 7, 9), *PLANS[5:]])
    assert along.air.issued == [(Cmd.DO_GRIPPER, (1.0, 0.0, 7.0, 9.0))]
    along.at(0, 0, 20)
    assert (along.air.result.seq_reached, along.seq, along.flies[1]) == (4, 3, (100, 100))


def test_back_a_transition_is_waited_for() -> None:
    along = Along(Way.REVERSE, 2, "vtol", [takeoff(15), do(Cmd.DO_VTOL_TRANSITION, 3), waypoint(300, 0, 30)])
    assert along.air.issued == [(Cmd.DO_VTOL_TRANSITION, (3.0, 0.0, 0.0, 0.0))]
    assert along.at(200, 0, 30, cycles=5).seq == 1
    along.air.status.vtol_state = VtolState.MC
    assert along.at(200, 0, 30).seq == 0


def test_back_the_next_point_is_the_position_before() -> None:
    along = Along(Way.REVERSE, 6)
    assert (along.seq, along.setpoint.next) == (5, pytest.approx((100.0, 100.0), abs=0.1))
    along.at(0, 100, 25)
    assert (along.seq, along.setpoint.next) == (3, pytest.approx((100.0, 0.0), abs=0.1))


def test_back_at_the_takeoff_it_lands_at_home_from_its_height() -> None:
    along = Along(Way.REVERSE, 1, plans=[waypoint(10, 0, 15), *PLANS])
    assert along.seq == 0
    along = Along(Way.REVERSE, 2, plans=[waypoint(300, 0, 15), *PLANS])
    assert along.seq == 1
    assert along.at(0, 0, 15).flies == (SetpointKind.POSITION, (-50, -50), 15.0)
    assert along.air.result.seq_reached == 1
    assert along.at(-50, -50, 15).flies == (SetpointKind.LAND, (-50, -50), 0.0)


def test_back_at_the_first_position_it_lands_at_home_too() -> None:
    along = Along(Way.REVERSE, 2, plans=[RELEASE, waypoint(100, 0, 15), waypoint(100, 100, 15)])
    assert along.setpoint.next is None
    assert along.at(100, 0, 15).flies == (SetpointKind.POSITION, (-50, -50), 15.0)


def test_back_a_landing_is_passed_like_a_waypoint() -> None:
    along = Along(Way.REVERSE, 6, from_mission=False, at=(0.0, 195.0, 5.0))
    assert (along.seq, along.flies) == (6, (SetpointKind.POSITION, (0, 200), 0.0))
    assert along.at(0, 200, 0).seq == 5


def test_back_a_vtol_that_hovers_takes_the_wing_before_each_item() -> None:
    along = Along(Way.REVERSE, 6, "vtol")
    assert (along.seq, along.air.issued) == (5, []), "it flies on its wing"
    along.air.status.vtol_state = VtolState.MC
    along.path.start(Way.REVERSE, HOME, None, None, True)
    assert along.air.issued == [TO_WING]
    along.air.status.vtol_state = VtolState.TRANSITION_TO_MC
    along.at(0, 150, 25, cycles=3)
    assert along.flies[1] == (0, 100), "not on the way yet"
    assert along.seq == 4
    along.air.status.vtol_state = VtolState.FW
    along.at(0, 150, 25)
    assert [command for command, _ in along.air.issued[1:]] == [Cmd.DO_GRIPPER]
    along.air.status.vtol_state = VtolState.MC
    along.at(0, 150, 25)
    assert (along.seq, along.air.issued[2:]) == (3, [TO_WING])


# straight to the landing ------------------------------------------------------------------------------------


def test_to_the_landing_it_climbs_where_it_is_and_says_how_high() -> None:
    along = Along(Way.TO_LANDING, 1, RTL_RETURN_ALT=40.0, at=(50.0, 0.0, 20.0))
    assert along.seq == 2
    assert along.flies == (SetpointKind.LOITER, (50, 0), 40.0)
    assert along.air.said[1:] == ["RTL Mission land: climb to 146 m"], "100.5 m + 5 m + 40 m, rounded up"
    assert along.air.events[1:] == [("rtl_mission_land_climb", 146)]


@pytest.mark.parametrize(("airframe", "tolerance_m"), [("quad", 0.8), ("plane", 10.0), ("vtol", 10.0)])
def test_to_the_landing_it_leaves_when_it_is_high_enough(airframe: str, tolerance_m: float) -> None:
    along = Along(Way.TO_LANDING, 1, airframe, RTL_RETURN_ALT=40.0)
    assert along.at(0, 0, 40 - tolerance_m - 0.1).flies[1] == (0, 0)
    along.at(0, 0, 40 - tolerance_m + 0.1)
    assert (along.seq, along.flies) == (3, (SetpointKind.POSITION, (100, 100), 25.0))


def test_who_is_high_enough_already_says_nothing() -> None:
    along = Along(Way.TO_LANDING, 1, RTL_RETURN_ALT=40.0, at=(0.0, 0.0, 44.5))
    assert len(along.air.said) == len(along.air.events) == 1


def test_its_height_is_measured_from_the_landings() -> None:
    plans = [takeoff(15), waypoint(100, 0, 15), Plan(Cmd.NAV_LAND, *GARDEN, 12.0)]
    along = Along(Way.TO_LANDING, 1, plans=plans, RTL_RETURN_ALT=40.0)
    assert along.flies[2] == 52.0
    near = Along(Way.TO_LANDING, 1, plans=plans, RTL_RETURN_ALT=40.0, at=(0.0, 196.0, 6.0))
    assert near.flies[2] == pytest.approx(12.0 + 2 * 4.0, abs=0.2), "near it is lower"


def test_to_the_landing_a_vtol_that_hovers_takes_the_wing_after_the_climb() -> None:
    along = Along(Way.TO_LANDING, 1, "vtol", RTL_RETURN_ALT=40.0)
    along.air.status.vtol_state = VtolState.MC
    along.at(0, 0, 41, cycles=4)
    assert (along.seq, along.air.issued) == (2, [TO_WING])
    along.air.status.vtol_state = VtolState.FW
    assert along.at(0, 0, 41).seq == 3


def test_a_landing_that_begins_behind_its_own_land_item_ends_in_a_loiter() -> None:
    plans = [takeoff(15), land(0, 200), do(Cmd.DO_LAND_START), waypoint(100, 0, 15)]
    along = Along(Way.TO_LANDING, 0, plans=plans, at=(0.0, 0.0, 60.0)).at(0, 0, 55)
    assert along.at(100, 0, 15).air.said[-1] == "Mission finished, loitering"


# a mission that changes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", [Way.FORWARD, Way.REVERSE, Way.TO_LANDING])
def test_a_mission_that_is_changed_ends_it_around_what_it_flew_to(way: Way) -> None:
    along = Along(way, 3)
    kind, place, up_m = along.flies
    along.air.upload(PLANS)
    along.at(30, 40, 26, cycles=10)
    there = (place, up_m) if kind in (SetpointKind.POSITION, SetpointKind.LOITER) else ((30, 40), 26.0)
    assert along.flies == (SetpointKind.LOITER, *there), "setEndOfMissionItems: around the current setpoint"
    assert along.air.said.count("Mission finished, loitering") == 1
    assert along.air.result.finished


def test_jumps_among_commands_for_ever_lead_nowhere() -> None:
    plans = [takeoff(15), waypoint(100, 0, 15, 0, 4), RELEASE, do(Cmd.DO_JUMP, 2, -1), land(0, 200)]
    along = Along(plans=plans).at(100, 0, 15)
    assert along.air.said[1:] == ["Mission finished, loitering"]


def test_the_jump_of_a_loop_is_taken_and_counted() -> None:
    plans = [takeoff(15), waypoint(100, 0, 15), waypoint(200, 0, 15), do(Cmd.DO_JUMP, 1, 1), land(0, 200)]
    along = Along(plans=plans, current=2)
    seen = [along.seq]
    for north_m in (200, 100, 200):
        seen.append(along.at(north_m, 0, 15).seq)
    assert seen == [2, 1, 2, 4]
