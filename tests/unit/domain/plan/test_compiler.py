"""A plan becomes the mission items that have the effect which the plan asks for on real PX4."""

from __future__ import annotations

import math

import pytest

from app.domain.autopilot.declared import default_facts
from app.domain.errors import PlanRejectedError
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem, MissionType
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from tests.support.plan_pieces import (
    RETURN,
    Json,
    airship,
    at,
    circle,
    delay,
    fixed_wing,
    gripper,
    land,
    loiter,
    multicopter,
    plan,
    rover,
    square,
    takeoff,
    transition,
    vtol,
    waypoint,
    winch,
    wing_takeoff,
)

NAN = math.nan


def _compiled(plan: Plan) -> Mission:
    return compile_plan(plan, default_facts(plan.vehicle_type))


def _commands(mission: Mission) -> list[str]:
    return [item.command.name for item in mission.items]


def _params(item: MissionItem) -> tuple[float, ...]:
    return (item.param1, item.param2, item.param3, item.param4)


def _same(found: tuple[float, ...], wanted: tuple[float, ...]) -> bool:
    return found == pytest.approx(wanted, nan_ok=True)


def test_a_supervised_drop_is_a_bounded_hold_with_a_small_radius_and_no_gripper_item() -> None:
    mission = _compiled(multicopter(waypoint(id="clinic"), gripper(id="drop", hold_s=40)))
    assert _commands(mission) == ["NAV_TAKEOFF", "NAV_WAYPOINT", "NAV_RETURN_TO_LAUNCH"]
    assert _same(_params(mission.items[1]), (40, 1, 0, NAN))
    (drop,) = mission.drops
    assert (drop.supervised, drop.stopped, drop.hold_seqs, drop.resume_seq, drop.release_seq) == (
        True,
        True,
        (1,),
        2,
        None,
    )
    assert (drop.hold_s, drop.acceptance_radius_m, drop.plan_item_id) == (40, 1, "drop")
    assert mission.seqs_of("drop") == ()


def test_an_embedded_drop_stops_releases_and_waits_for_the_gripper() -> None:
    mission = _compiled(multicopter(waypoint(), gripper(id="drop", mode="embedded")))
    assert _commands(mission)[1:4] == ["NAV_WAYPOINT", "DO_GRIPPER", "NAV_DELAY"]
    assert _same(_params(mission.items[1]), (5, 1, 0, NAN))
    assert _same(_params(mission.items[2]), (1, 0, NAN, NAN))
    assert _same(_params(mission.items[3]), (2, -1, -1, -1))
    (drop,) = mission.drops
    assert (drop.hold_seqs, drop.release_seq, drop.resume_seq) == ((1,), 2, 4)
    assert mission.seqs_of("drop") == (2, 3)


def test_release_is_0_and_grab_is_1() -> None:
    mission = _compiled(
        multicopter(
            waypoint(),
            gripper(mode="embedded"),
            waypoint(50),
            gripper(action="grab", mode="embedded"),
        )
    )
    assert [item.param2 for item in mission.items if item.command is MavCmd.DO_GRIPPER] == [0, 1]


def test_a_moving_drop_passes_without_a_hold() -> None:
    mission = _compiled(multicopter(waypoint(), gripper("moving", mode="embedded")))
    assert _commands(mission)[1:] == ["NAV_WAYPOINT", "DO_GRIPPER", "NAV_RETURN_TO_LAUNCH"]
    assert _same(_params(mission.items[1]), (0, NAN, 0, NAN))
    assert mission.drops[0].acceptance_radius_m == 10


def test_a_hold_that_is_longer_or_a_radius_that_is_smaller_stays() -> None:
    mission = _compiled(multicopter(waypoint(hold_s=50, acceptance_radius_m=0.5), gripper()))
    assert _same(_params(mission.items[1]), (50, 0.5, 0, NAN))
    assert mission.drops[0].hold_s == 50


@pytest.mark.parametrize("more", [{}, {"alternate": at(100, 80, relative_altitude_m=30)}], ids=["alone", "alternate"])
def test_a_photo_and_a_speed_before_a_supervised_drop_are_done_before_its_hold(more: Json) -> None:
    photo, speed = {"type": "photo", "id": "before"}, {"type": "change_speed", "speed_m_s": 3, "id": "slow"}
    mission = _compiled(multicopter(waypoint(id="door"), photo, speed, gripper(id="drop", **more)))
    assert _commands(mission)[1:5] == ["NAV_WAYPOINT", "IMAGE_START_CAPTURE", "DO_CHANGE_SPEED", "NAV_WAYPOINT"]
    assert _same(_params(mission.items[1]), (1, 1, 0, NAN)), "it stops for the photo"
    assert mission.items[4].x == mission.items[1].x
    assert (mission.seqs_of("before"), mission.seqs_of("slow")) == ((2,), (3,))
    assert mission.drops[0].hold_seqs == (4,)


def test_a_delay_before_a_supervised_drop_is_over_before_the_hold_begins() -> None:
    mission = _compiled(multicopter(waypoint(id="place"), delay(), gripper(id="drop")))
    assert _commands(mission)[1:4] == ["NAV_WAYPOINT", "NAV_DELAY", "NAV_WAYPOINT"]
    assert mission.items[3].x == mission.items[1].x
    assert mission.drops[0].hold_seqs == mission.seqs_of("drop") == (3,)
    assert mission.drops[0].resume_seq == 4


def test_a_supervised_drop_after_a_hovering_loiter_gets_a_hold_of_its_own() -> None:
    mission = _compiled(multicopter(loiter(duration_s=10), gripper(id="drop")))
    assert _commands(mission)[1:3] == ["NAV_LOITER_TIME", "NAV_WAYPOINT"]
    assert (mission.items[1].x, mission.items[1].y) == (mission.items[2].x, mission.items[2].y)
    assert mission.drops[0].hold_seqs == mission.seqs_of("drop") == (2,)


@pytest.mark.parametrize(
    "drop", [gripper(mode="embedded"), gripper(action="grab"), winch()], ids=["release", "grab", "winch"]
)
@pytest.mark.parametrize("place", [loiter(duration_s=0), loiter("to_altitude")], ids=["time", "to_altitude"])
def test_an_embedded_drop_after_a_hovering_loiter_stops_at_a_waypoint_of_its_own(place: Json, drop: Json) -> None:
    mission = _compiled(multicopter(place, {**drop, "id": "drop"}))
    assert _commands(mission)[2] == "NAV_WAYPOINT"
    assert _same(_params(mission.items[2]), (5, 1, 0, NAN))
    assert (mission.items[1].x, mission.items[1].y) == (mission.items[2].x, mission.items[2].y)
    assert mission.seqs_of("drop") == (2, 3, 4)
    assert all((one.hold_seqs, one.release_seq) == ((1, 2), 3) for one in mission.drops)


def test_two_supervised_drops_at_one_place_hold_twice() -> None:
    mission = _compiled(multicopter(waypoint(), gripper(), winch(mode="supervised")))
    first, second = mission.drops
    assert (first.hold_seqs, first.resume_seq, second.hold_seqs, second.resume_seq) == ((1,), 2, (2,), 3)


def test_a_grab_is_an_item_of_the_mission_and_no_drop() -> None:
    mission = _compiled(multicopter(waypoint(), gripper(action="grab"), waypoint(50), gripper()))
    assert _commands(mission)[1:3] == ["NAV_WAYPOINT", "DO_GRIPPER"]
    assert mission.items[2].param2 == 1.0
    assert [mission.items[drop.hold_seqs[0]].command for drop in mission.drops] == [MavCmd.NAV_WAYPOINT]
    assert len(mission.drops) == 1


def test_a_supervised_drop_is_never_resumed_at_a_release() -> None:
    mission = _compiled(multicopter(waypoint(), gripper(), gripper(mode="embedded")))
    resume = mission.items[mission.drops[0].resume_seq]
    assert resume.command not in (MavCmd.DO_GRIPPER, MavCmd.DO_WINCH)


def test_a_supervised_drop_on_the_ground_waits_in_a_delay() -> None:
    mission = _compiled(multicopter(land(50), gripper(), waypoint(50)))
    assert _commands(mission)[1:4] == ["NAV_LAND", "NAV_DELAY", "NAV_WAYPOINT"]
    (drop,) = mission.drops
    assert (drop.landed, drop.hold_seqs, drop.resume_seq) == (True, (1, 2), 3)


def test_a_supervised_rover_waits_in_a_delay_and_has_something_to_resume_at() -> None:
    mission = _compiled(plan("rover", waypoint(30, 0, 0), gripper(id="drop")))
    assert _commands(mission) == ["NAV_WAYPOINT", "NAV_DELAY", "NAV_DELAY"]
    (drop,) = mission.drops
    assert (drop.hold_seqs, drop.resume_seq) == ((0, 1), 2)
    assert mission.seqs_of("drop") == (1, 2)


def test_an_embedded_rover_stops_by_its_delay() -> None:
    mission = _compiled(rover(waypoint(30, 0, 0), delay(), gripper(mode="embedded")))
    assert _commands(mission) == ["NAV_WAYPOINT", "NAV_DELAY", "DO_GRIPPER", "NAV_DELAY", "NAV_WAYPOINT"]
    assert mission.drops[0].hold_seqs == (0, 1)


def test_a_fixed_wing_drops_in_passing_and_lands_by_a_pattern() -> None:
    approach = at(80, 300, relative_altitude_m=20, radius_m=-60)
    mission = _compiled(
        plan(
            "fixed_wing", wing_takeoff(), waypoint(400), gripper("moving"), waypoint(400, 300), land(approach=approach)
        )
    )
    assert _commands(mission)[1:] == [
        "NAV_WAYPOINT",
        "DO_GRIPPER",
        "NAV_WAYPOINT",
        "DO_LAND_START",
        "NAV_LOITER_TO_ALT",
        "NAV_LAND",
    ]
    assert _same(_params(mission.items[0]), (15, 0, 0, NAN))
    assert _same(_params(mission.items[5]), (1, -60, 0, 1))
    assert mission.items[5].z == 20
    assert not mission.drops[0].supervised


def test_a_vtol_takes_off_and_lands_as_one_and_hovers_for_the_drop() -> None:
    mission = _compiled(
        vtol(transition("multicopter"), waypoint(300), gripper(), transition("fixed_wing"), waypoint(200))
    )
    assert _commands(mission) == [
        "NAV_VTOL_TAKEOFF",
        "DO_VTOL_TRANSITION",
        "NAV_WAYPOINT",
        "DO_VTOL_TRANSITION",
        "NAV_WAYPOINT",
        "NAV_VTOL_LAND",
    ]
    assert [item.param1 for item in mission.items if item.command is MavCmd.DO_VTOL_TRANSITION] == [3, 4]
    assert mission.drops[0].supervised
    assert _same(_params(mission.items[2]), (30, 1, 0, NAN))


def test_a_vtol_in_fixed_wing_flight_drops_in_passing() -> None:
    (drop,) = _compiled(vtol(waypoint(300), gripper("moving"))).drops
    assert not drop.supervised
    assert drop.acceptance_radius_m == pytest.approx(33.6)


def test_a_winch_is_embedded_and_gets_all_its_time() -> None:
    mission = _compiled(multicopter(waypoint(), winch(action="length", length_m=8, hold_s=20)))
    assert _commands(mission)[2:4] == ["DO_WINCH", "NAV_DELAY"]
    assert _same(_params(mission.items[2]), (1, 1, 8, NAN))
    assert mission.items[3].param1 == 20


def test_an_airship_passes() -> None:
    mission = _compiled(airship(waypoint(), gripper("moving")))
    assert _commands(mission) == ["NAV_TAKEOFF", "NAV_WAYPOINT", "DO_GRIPPER", "NAV_WAYPOINT"]


def test_a_jump_names_the_first_item_of_its_target() -> None:
    jump = {"type": "jump", "target": "a", "repeats": 3}
    mission = _compiled(multicopter(waypoint(), waypoint(50, id="a", speed_m_s=3), waypoint(), jump))
    assert _commands(mission)[2:4] == ["DO_CHANGE_SPEED", "NAV_WAYPOINT"]
    assert _same(_params(mission.items[5]), (2, 3, NAN, NAN))


def test_the_cruise_speed_is_set_after_the_takeoff_and_at_once_on_wheels() -> None:
    flying = _compiled(multicopter(waypoint(), cruise_speed_m_s=7))
    assert _commands(flying)[:2] == ["NAV_TAKEOFF", "DO_CHANGE_SPEED"]
    assert _same(_params(flying.items[1]), (1, 7, -1, NAN))
    driving = _compiled(rover(waypoint(30, 0, 0), cruise_speed_m_s=1))
    assert _commands(driving)[0] == "DO_CHANGE_SPEED"


def test_a_fixed_wing_is_asked_for_airspeed_unless_the_plan_says_otherwise() -> None:
    air = {"type": "change_speed", "speed_m_s": 12}
    mission = _compiled(fixed_wing(air, waypoint(400), air | {"speed_type": "groundspeed"}))
    assert [item.param1 for item in mission.items if item.command is MavCmd.DO_CHANGE_SPEED] == [0, 1]


def test_loiters_keep_the_sign_of_their_radius_and_nan_for_none() -> None:
    mission = _compiled(
        fixed_wing(loiter("time", radius_m=-70), loiter("to_altitude", 600), loiter("unlimited", radius_m=50))
    )
    assert _same(_params(mission.items[1]), (20, 0, -70, 0))
    assert _same(_params(mission.items[2]), (0, NAN, 0, 0))
    assert _same(_params(mission.items[3]), (0, 0, 50, NAN))


def test_positions_are_in_the_frame_of_their_altitude_and_commands_in_the_mission_frame() -> None:
    amsl = {"type": "waypoint", **at(50, 0), "absolute_altitude_m": 510}
    mission = _compiled(multicopter(amsl, waypoint(), delay()))
    frames = [item.frame for item in mission.items]
    assert frames == [
        MavFrame.GLOBAL_RELATIVE_ALT_INT,
        MavFrame.GLOBAL_INT,
        MavFrame.GLOBAL_RELATIVE_ALT_INT,
        MavFrame.MISSION,
        MavFrame.MISSION,
    ]
    assert mission.items[1].z == 510


def test_a_takeoff_without_a_position_is_above_home() -> None:
    mission = _compiled(multicopter(waypoint()))
    assert (mission.items[0].x, mission.items[0].y) == (473977420, 85455940)


def test_fence_and_rally_go_into_lists_of_their_own() -> None:
    fence = {"polygons": [square("inclusion", 0, 0, 200)], "circles": [circle("exclusion", 50, 50, 9)]}
    mission = _compiled(multicopter(waypoint(), geofence=fence, rally_points=[at(20, 0, absolute_altitude_m=520)]))
    assert [(item.command.value, item.param1) for item in mission.fence] == [(5001, 4)] * 4 + [(5004, 9)]
    assert {item.mission_type for item in mission.fence} == {MissionType.FENCE}
    assert [(item.command.value, item.frame.value, item.z) for item in mission.rally] == [(5100, 5, 520)]


@pytest.mark.parametrize(
    "items",
    [
        (gripper(), RETURN),
        (loiter("turns", turns=2), RETURN),
        ({"type": "jump", "target": "nowhere", "repeats": 1}, RETURN),
    ],
)
def test_what_cannot_be_compiled_says_so(items: tuple[dict[str, object], ...]) -> None:
    with pytest.raises(PlanRejectedError):
        _compiled(plan("multicopter", takeoff(), *items))


def test_a_plan_for_another_type_is_not_compiled() -> None:
    with pytest.raises(PlanRejectedError, match="the plan is for a multicopter, but the vehicle is a fixed wing"):
        compile_plan(multicopter(waypoint()), default_facts(fixed_wing().vehicle_type))
