"""Returns along the mission (RTL_TYPE 2 and 4), and to its landing (1 and 3): which items are flown, and how."""

from __future__ import annotations

import math

import pytest

from app.simulator.params import Value
from app.simulator.setpoint import SetpointKind
from app.simulator.wire import Cmd, Mode, VtolState
from tests.support.simulated_vehicle import RELEASE, GroundStation, Plan, do, land, takeoff, waypoint

NORTH, EAST, GARDEN = (60.0, 0.0), (60.0, 60.0), (0.0, 60.0)
TO_GARDEN = [
    takeoff(12),
    waypoint(*NORTH, 12, 0, 2),
    waypoint(*EAST, 12, 30, 2),
    RELEASE,
    do(Cmd.NAV_DELAY, 30),
    waypoint(20, 60, 12, 0, 2),
    land(*GARDEN),
]


def returning(plans: list[Plan], seq: int, airframe: str = "quad", **params: Value) -> GroundStation:
    """On its way to `seq` when a return is commanded out of mission mode."""
    gcs = GroundStation(airframe, params={"RTL_TYPE": 2, "MIS_TKO_LAND_REQ": 0, "RTL_RETURN_ALT": 40.0, **params})
    gcs.start(plans)
    gcs.until(lambda: gcs.vehicle.store.current_seq == seq)
    gcs.command(Cmd.NAV_RETURN_TO_LAUNCH)
    return gcs


def visits(gcs: GroundStation, *points: tuple[float, float]) -> list[int]:
    """Flies until disarmed; the places by number, in the order in which the vehicle came within 3 m."""
    seen: list[int] = []

    def look() -> bool:
        near = [number for number, point in enumerate(points) if gcs.distance_to(*point) < 3.0]
        seen.extend(number for number in near if not seen or seen[-1] != number)
        return not gcs.armed

    gcs.until(look, 400.0)
    return seen


def highest_m(gcs: GroundStation, since_s: float) -> float:
    return max(message.relative_alt for message in gcs.messages("GLOBAL_POSITION_INT", since_s)) / 1000.0


def commands(gcs: GroundStation, since_s: float) -> list[int]:
    return [message.command for message in gcs.messages("COMMAND_LONG", since_s)]


# on to the landing ------------------------------------------------------------------------------------------


def test_on_to_the_landing_it_passes_all_positions_without_holding_and_gives_no_command() -> None:
    gcs = returning(TO_GARDEN, 1)
    begin_s = gcs.now_s
    assert visits(gcs, NORTH, EAST, (20.0, 60.0), GARDEN) == [0, 1, 2, 3]
    assert gcs.now_s - begin_s < 90.0, "the hold of 30 s and the delay of 30 s are left out"
    assert Cmd.DO_GRIPPER not in commands(gcs, begin_s)
    assert not gcs.vehicle.state.gripper.released
    assert highest_m(gcs, begin_s) < 14.0, "no climb to RTL_RETURN_ALT"
    assert gcs.distance_to(*GARDEN) < 1.0
    assert "Mission finished, landed" in gcs.texts()
    assert gcs.last("MISSION_ITEM_REACHED").seq == 6, "the landing, too"


def test_it_goes_on_to_the_position_that_it_flew_to_and_shows_it() -> None:
    gcs = returning(TO_GARDEN, 2)
    gcs.fly(0.2)
    assert (gcs.vehicle.store.current_seq, gcs.vehicle.context.setpoint.point) == (
        2,
        pytest.approx(EAST, abs=0.1),
    )
    assert "Executing Mission" in gcs.texts()[-2:]
    assert gcs.vehicle.mission.result.seq_reached == -1, "item 1 is not reported again"
    gcs.until(lambda: gcs.vehicle.store.current_seq == 5)
    gcs.fly(1.1)
    assert gcs.last("MISSION_CURRENT").seq == 5
    assert gcs.last("MISSION_ITEM_REACHED").seq == 2
    assert gcs.last("HEARTBEAT").custom_mode == Mode.RTL


def test_past_its_last_position_it_goes_to_the_landing_that_it_has_left_behind() -> None:
    gcs = GroundStation(params={"RTL_TYPE": 2})
    gcs.start([takeoff(12), waypoint(30, 0, 12, 0, 2), land(*GARDEN), do(Cmd.NAV_DELAY, 60)])
    gcs.until(lambda: gcs.vehicle.state.body.north_m > 20.0)
    gcs.vehicle.mission.set_current(3, at_once=True)
    gcs.fly(0.1)
    gcs.command(Cmd.NAV_RETURN_TO_LAUNCH)
    assert gcs.vehicle.store.current_seq == 2
    visits(gcs)
    assert gcs.distance_to(*GARDEN) < 1.0


def test_out_of_another_mode_it_begins_at_the_nearest_position() -> None:
    gcs = GroundStation(params={"RTL_TYPE": 2})
    gcs.start(TO_GARDEN)
    gcs.until(lambda: gcs.vehicle.store.current_seq == 1 and gcs.vehicle.state.body.north_m > 10.0)
    gcs.set_mode(Mode.LOITER)
    gcs.fly(5.0)
    gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.east_m = 40.0, 50.0
    gcs.set_mode(Mode.RTL)
    assert gcs.vehicle.store.current_seq == 5


def test_the_nearest_position_is_the_nearest_in_space() -> None:
    gcs = returning([takeoff(12), waypoint(*NORTH, 12, 0, 2), waypoint(*NORTH, 60, 0, 2), land(*GARDEN)], 1)
    gcs.set_mode(Mode.LOITER)
    gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.up_m = 50.0, 55.0
    gcs.set_mode(Mode.RTL)
    assert gcs.vehicle.store.current_seq == 2


def test_a_jump_is_flown_as_often_as_the_mission_would() -> None:
    loop = [takeoff(12), waypoint(*NORTH, 12, 0, 2), waypoint(*EAST, 12, 0, 2), do(Cmd.DO_JUMP, 1, 1), land(*GARDEN)]
    assert visits(returning(loop, 1), NORTH, EAST, GARDEN) == [0, 1, 0, 1, 2]


FOR_EVER = [takeoff(12), waypoint(*NORTH, 12, 0, 2), do(Cmd.NAV_DELAY, 1), do(Cmd.DO_JUMP, 2, -1), land(*GARDEN)]


def test_a_jump_for_ever_over_items_without_a_position_ends_in_a_loiter() -> None:
    gcs = returning(FOR_EVER, 1)
    gcs.until(lambda: gcs.vehicle.mission.result.finished)
    gcs.fly(5.0)
    assert gcs.distance_to(*NORTH) < 10.0
    assert "Mission finished, loitering" in gcs.texts()


def test_a_jump_for_ever_out_of_the_delay_goes_to_the_landing() -> None:
    assert visits(returning(FOR_EVER, 2), GARDEN) == [0]


@pytest.mark.parametrize("way", ["forward", "back", "to the landing", "command"])
def test_a_mission_that_is_cleared_on_the_return_ends_it_in_a_loiter(way: str) -> None:
    plans, params = (NO_LANDING, 2) if way == "back" else (TO_GARDEN, 1 if way == "to the landing" else 2)
    gcs = returning(plans, 1 if way == "forward" else 3, RTL_TYPE=params) if way != "command" else transitioning()
    if way == "to the landing":
        gcs.set_mode(Mode.LOITER)
        gcs.set_mode(Mode.RTL)
    assert not gcs.vehicle.mission.result.finished
    gcs.vehicle.store.clear(0)
    gcs.fly(2.0)
    assert gcs.vehicle.mission.result.finished
    assert gcs.vehicle.context.setpoint.kind is SetpointKind.LOITER
    assert "Mission finished, loitering" in gcs.texts()


def transitioning() -> GroundStation:
    """A VTOL whose way back begins with a transition that takes its time."""
    plans = [
        takeoff(40, north_m=60.0, command=Cmd.NAV_VTOL_TAKEOFF),
        waypoint(300, 0, 40),
        do(Cmd.DO_VTOL_TRANSITION, 3),
        waypoint(600, 0, 40, 60, 3),
    ]
    return returning(plans, 3, "vtol")


# back -------------------------------------------------------------------------------------------------------

NO_LANDING = [takeoff(12), waypoint(*NORTH, 12, 0, 2), waypoint(*EAST, 12, 0, 2), waypoint(*GARDEN, 12, 60, 2)]


def test_without_a_landing_it_flies_back_by_the_items_and_lands_at_home() -> None:
    gcs = returning(NO_LANDING, 3)
    begin_s = gcs.now_s
    assert visits(gcs, GARDEN, EAST, NORTH, (0.0, 0.0)) == [1, 2, 3]
    assert highest_m(gcs, begin_s) < 14.0
    assert gcs.distance_to(0.0, 0.0) < 1.0


def test_back_without_a_takeoff_item_it_lands_at_home_after_the_first_position() -> None:
    gcs = returning([waypoint(*NORTH, 12, 0, 2), waypoint(*EAST, 12, 0, 2), waypoint(*GARDEN, 12, 60, 2)], 2)
    assert visits(gcs, EAST, NORTH, (0.0, 0.0)) == [0, 1, 2]
    assert gcs.distance_to(0.0, 0.0) < 1.0


def test_a_plane_joins_the_mission_at_no_landing() -> None:
    gcs = returning([takeoff(30, north_m=150.0), waypoint(400, 0, 40), land(1000.0, 0.0)], 1, "plane")
    gcs.set_mode(Mode.LOITER)
    gcs.vehicle.state.body.north_m = 980.0
    gcs.set_mode(Mode.RTL)
    assert gcs.vehicle.store.current_seq == 1


def test_back_from_another_mode_it_begins_at_the_nearest_position() -> None:
    gcs = returning(NO_LANDING, 3)
    gcs.set_mode(Mode.LOITER)
    gcs.vehicle.state.body.east_m = 40.0  # twenty metres before the second
    gcs.set_mode(Mode.RTL)
    assert gcs.vehicle.store.current_seq == 2


def test_on_the_way_back_a_landing_is_a_position_like_any_other() -> None:
    gcs = returning(TO_GARDEN, 1, RTL_TYPE=4)
    gcs.set_mode(Mode.LOITER)
    gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.east_m = -10.0, 70.0
    gcs.set_mode(Mode.RTL)
    assert gcs.vehicle.store.current_seq == 6
    assert gcs.vehicle.context.setpoint.kind is SetpointKind.POSITION


def test_back_it_begins_with_the_item_before_also_a_release() -> None:
    """As PX4 does: the item is executed, whatever it is. A supervised release skips such an item by set-current."""
    plans = [takeoff(12), waypoint(*NORTH, 12, 600, 2), RELEASE, waypoint(*EAST, 12, 0, 2)]
    gcs = GroundStation(params={"RTL_TYPE": 2})
    gcs.start(plans)
    gcs.until(lambda: gcs.vehicle.state.body.up_m > 11.0)
    gcs.vehicle.mission.set_current(3, at_once=True)
    gcs.fly(1.0)
    assert not gcs.vehicle.state.gripper.released
    gcs.command(Cmd.NAV_RETURN_TO_LAUNCH)
    assert gcs.vehicle.state.gripper.released
    assert visits(gcs, NORTH, (0.0, 0.0)) == [1, 0, 1]


def test_type_4_takes_the_shorter_of_both() -> None:
    assert visits(returning(TO_GARDEN, 1, RTL_TYPE=4), EAST, (0.0, 0.0))[-1:] == [1]
    assert visits(returning(TO_GARDEN, 5, RTL_TYPE=4), EAST, GARDEN)[-1:] == [1]


def test_a_plane_lands_straight_at_home_after_the_takeoff_point() -> None:
    plans = [takeoff(30, north_m=150.0), waypoint(400, 0, 40), waypoint(400, 400, 40), waypoint(0, 800, 40)]
    gcs = returning(plans, 3, "plane")
    gcs.until(lambda: gcs.vehicle.context.setpoint.kind is SetpointKind.LAND, 400.0)
    gcs.until(lambda: not gcs.armed, 200.0)
    assert gcs.distance_to(0.0, 0.0) < 80.0


def test_a_vtol_that_hovers_takes_the_wing_for_the_way_back() -> None:
    plans = [
        takeoff(40, north_m=60.0, command=Cmd.NAV_VTOL_TAKEOFF),
        waypoint(300, 0, 40),
        do(Cmd.DO_VTOL_TRANSITION, 3),
        waypoint(600, 0, 40, 60, 3),
    ]
    gcs = returning(plans, 3, "vtol")
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.FW, 30.0)
    gcs.until(lambda: gcs.vehicle.state.status.vtol_state == VtolState.MC, 200.0)
    visits(gcs)
    assert gcs.distance_to(0.0, 0.0) < 1.0


# to the landing ---------------------------------------------------------------------------------------------


def test_to_the_landing_a_plane_climbs_flies_where_it_begins_and_lands_as_the_mission_does() -> None:
    approach = Plan(Cmd.NAV_LOITER_TO_ALT, 300.0, 300.0, 30.0, (0.0, 60.0, 0.0, math.nan))
    landing = [do(Cmd.DO_LAND_START), approach, land(700.0, 300.0)]
    plans = [takeoff(30, north_m=150.0), waypoint(500, 0, 40), waypoint(900, 0, 40), *landing]
    gcs = returning(plans, 1, "plane", RTL_TYPE=3, RTL_RETURN_ALT=70.0)
    begin_s = gcs.now_s
    gcs.vehicle.state.body.north_m, gcs.vehicle.state.body.east_m = 500.0, 200.0  # nearer to it than to home
    gcs.set_mode(Mode.LOITER)
    gcs.set_mode(Mode.RTL)
    assert "RTL Mission land: climb to" in "".join(gcs.texts())
    assert gcs.vehicle.store.current_seq == 3
    gcs.until(lambda: gcs.vehicle.store.current_seq == 4)
    assert gcs.vehicle.state.body.up_m > 59.0
    assert gcs.vehicle.context.setpoint.kind is SetpointKind.LOITER, "the one item that is not a mere waypoint"
    gcs.until(lambda: gcs.vehicle.store.current_seq == 5, 300.0)
    gcs.until(lambda: not gcs.armed, 200.0)
    assert gcs.distance_to(700.0, 300.0) < 60.0
    assert highest_m(gcs, begin_s) < 80.0


def test_to_the_landing_a_multicopter_flies_over_it_at_its_height_and_lands() -> None:
    gcs = returning(TO_GARDEN, 5, RTL_TYPE=1, RTL_RETURN_ALT=25.0)
    begin_s = gcs.now_s
    assert visits(gcs, GARDEN) == [0]
    assert highest_m(gcs, begin_s) == pytest.approx(25.0, abs=1.0)
    assert gcs.distance_to(*GARDEN) < 1.0
