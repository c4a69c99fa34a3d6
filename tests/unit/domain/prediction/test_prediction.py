"""The prediction says when, how far and where each drop acts; recorded PX4 flights are its measure."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.autopilot.declared import default_facts
from app.domain.geo import distance_m
from app.domain.plan import Plan
from app.domain.prediction import CALM, PredictedDrop, Timeline, Wind, predict
from app.domain.prediction.rotary import TrajectoryLimits, travel_s
from app.domain.vehicle.state import InFlight
from tests.support.plan_pieces import (
    HOME,
    RETURN,
    Json,
    at,
    change_speed,
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

APPROACH = ("latitude_deg", "longitude_deg", "relative_altitude_m", "radius_m")


def _timeline(plan: Plan) -> Timeline:
    return predict(plan, default_facts(plan.vehicle_type))


def _drop(plan: Plan) -> PredictedDrop:
    (drop,) = _timeline(plan).drops
    return drop


def test_times_follow_each_other_and_sum_up() -> None:
    timeline = _timeline(multicopter(waypoint(), gripper(), waypoint(50)))
    assert [entry.item_id for entry in timeline.entries] == ["item-1", "item-2", "item-3", "item-4", "item-5"]
    for entry, following in zip(timeline.entries, timeline.entries[1:], strict=False):
        assert entry.end_s == following.start_s
    assert timeline.entries[-1].end_s == timeline.duration_s
    assert timeline.distance_m == pytest.approx(100 + 50 + 50, abs=0.1)


def test_a_recorded_multicopter_delivery_is_predicted_within_15_percent() -> None:
    # 07_quad_delivery_hold, from the order to fly: each REACHED, and the end of the return by "on ground".
    flight = multicopter(waypoint(60, 0, 15, hold_s=5), gripper(mode="embedded"), waypoint(60, 45, 15), home=None)
    timeline = predict(flight, facts(home=HOME))
    takeoff_s, drop_s, gripper_s, last_s, return_s = (entry.duration_s for entry in timeline.entries)
    assert takeoff_s == pytest.approx(15.6, rel=0.15)
    assert drop_s == pytest.approx(21.3, rel=0.15)
    assert gripper_s == pytest.approx(2.0, rel=0.15)
    assert last_s == pytest.approx(9.9, rel=0.15)
    assert return_s == pytest.approx(55.1, rel=0.15)


def test_a_drop_that_asks_is_predicted_with_the_slowest_answer() -> None:
    def drop_s(**asks: object) -> float:
        return _timeline(multicopter(waypoint(), gripper(hold_s=40, **asks))).entries[2].duration_s

    assert drop_s(consent="operator", consent_timeout_s=20) == pytest.approx(drop_s() + 20.0)
    assert drop_s(consent="operator") == pytest.approx(drop_s() + 35.0), "as long as the hold allows"


def test_on_a_circle_that_is_too_tight_a_drop_is_as_far_away_as_the_tightest_turn() -> None:
    wide, tight = (_drop(fixed_wing(loiter(radius_m=radius_m), gripper("moving"))) for radius_m in (60, 1))
    assert wide.offset_m == 60
    assert tight.offset_m == pytest.approx(24.6, abs=0.1)


def test_a_jump_is_unrolled() -> None:
    jump = {"type": "jump", "target": "a", "repeats": 2, "id": "again"}
    timeline = _timeline(multicopter(waypoint(id="a"), waypoint(50, id="b"), jump, waypoint(20, id="c")))
    assert timeline.order == ("item-1", "a", "b", "a", "b", "a", "b", "c", "item-6")
    assert [entry.visit for entry in timeline.entries if entry.item_id == "b"] == [1, 2, 3]


def test_the_inner_jump_of_two_is_used_up_after_the_first_round() -> None:
    inner = {"type": "jump", "target": "b", "repeats": 1}
    outer = {"type": "jump", "target": "a", "repeats": 1}
    timeline = _timeline(multicopter(waypoint(id="a"), waypoint(50, id="b"), inner, outer))
    assert timeline.order == ("item-1", "a", "b", "b", "a", "b", "item-6")


def test_millions_of_visits_are_cut_off() -> None:
    jump = {"type": "jump", "target": "a", "repeats": 1000}
    timeline = _timeline(multicopter(waypoint(id="a"), *[waypoint(50)] * 10, jump))
    assert timeline.truncated
    assert len(timeline.order) == 5000


def test_nothing_is_predicted_after_an_endless_loiter() -> None:
    timeline = _timeline(plan("multicopter", takeoff(), loiter("unlimited"), RETURN))
    assert timeline.open_ended
    assert timeline.order == ("item-1", "item-2")


def test_a_stopped_drop_is_within_its_radius_and_stands() -> None:
    drop = _drop(multicopter(waypoint(), gripper()))
    assert (drop.offset_m, drop.lead_m, drop.ground_speed_m_s, drop.throw_m) == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("firmware", "trim_m_s", "lead_m"),
    [((1, 18, 0), 12, 26.9), ((1, 18, 0), 15, 33.6), ((1, 13, 3), 20, 95.4)],
)
def test_a_fixed_wing_releases_one_switch_distance_early(
    firmware: tuple[int, int, int], trim_m_s: float, lead_m: float
) -> None:
    flight = fixed_wing(waypoint(400), gripper("moving"))
    (drop,) = predict(flight, facts("fixed_wing", firmware=firmware, FW_AIRSPD_TRIM=trim_m_s)).drops
    assert drop.lead_m == pytest.approx(lead_m, abs=0.1)  # recorded at 12 m/s: 26 m
    assert drop.release_latitude_deg is not None
    assert drop.release_longitude_deg is not None
    away_m = distance_m(HOME.latitude_deg, HOME.longitude_deg, drop.release_latitude_deg, drop.release_longitude_deg)
    assert away_m == pytest.approx(400 - lead_m, abs=0.5)


def test_a_parcel_flies_on_while_it_falls() -> None:
    drop = _drop(fixed_wing(waypoint(400, 0, 45), gripper("moving")))
    assert 3.03 < drop.fall_s < 4.0  # without drag 3.03 s and 45.4 m
    assert 30.0 < drop.throw_m < 45.4


def test_the_wind_carries_a_parcel_from_where_it_was_let_go() -> None:
    flight = multicopter(waypoint(100, 0, 60), gripper())
    (drop,) = predict(flight, facts(), Wind(east_m_s=8.0)).drops
    assert drop.release_latitude_deg == pytest.approx(drop.landing_latitude_deg)
    assert drop.release_longitude_deg is not None
    assert drop.landing_longitude_deg is not None
    east_m = distance_m(47.4, drop.release_longitude_deg, 47.4, drop.landing_longitude_deg)
    assert east_m == pytest.approx(drop.throw_m, rel=0.01)
    assert 0.2 * 8.0 * drop.fall_s < drop.throw_m < 8.0 * drop.fall_s


def test_a_timeline_says_the_wind_that_it_reckons_with() -> None:
    wind = Wind(east_m_s=8.0)
    assert predict(multicopter(waypoint()), facts(), wind).wind == wind
    assert predict(multicopter(waypoint()), facts()).wind == CALM


def test_a_drop_from_a_circle_is_one_radius_away_and_nobody_knows_where() -> None:
    drop = _drop(fixed_wing(loiter(radius_m=-70), gripper("moving")))
    assert (drop.offset_m, drop.release_latitude_deg) == (70, None)


def test_a_recorded_rover_reaches_its_waypoint_1_3_m_early_and_stops_at_it() -> None:
    corner = _drop(rover(waypoint(30, 0, 0), gripper("moving"), waypoint(30, 20, 0)))
    assert corner.lead_m == pytest.approx(1.3, abs=0.1)
    assert _drop(rover(waypoint(30, 0, 0), delay(), gripper(mode="embedded"))).lead_m == 0


def test_a_vtol_is_slow_while_it_hovers() -> None:
    timeline = _timeline(vtol(waypoint(200), transition("multicopter"), waypoint(300), gripper()))
    speeds = {entry.item_id: entry.ground_speed_m_s for entry in timeline.entries}
    assert (speeds["item-2"], speeds["item-4"]) == (15, 5)


def test_where_it_brakes_is_said() -> None:
    timeline = _timeline(multicopter(waypoint(), waypoint(50, hold_s=3), waypoint(60), gripper(), land(20), waypoint()))
    brakes = {entry.item_id: entry.brakes for entry in timeline.entries}
    assert brakes == {
        "item-1": False,
        "item-2": False,
        "item-3": True,
        "item-4": True,
        "item-5": False,
        "item-6": True,
        "item-7": False,
        "item-8": True,
    }


def test_a_speed_of_the_plan_makes_it_longer() -> None:
    fast, slow = _timeline(multicopter(waypoint())), _timeline(multicopter(waypoint(speed_m_s=1)))
    assert slow.duration_s > fast.duration_s + 70


def test_a_plan_with_errors_is_predicted_as_far_as_it_goes() -> None:
    timeline = _timeline(multicopter(gripper(), loiter("turns", turns=2)))
    assert len(timeline.entries) == 4
    assert timeline.drops == ()
    assert {entry.seqs for entry in timeline.entries} == {()}


def test_a_recorded_plane_delivery_is_predicted_within_15_percent() -> None:
    # 10_plane_delivery: takeoff 10.5 s, pass 24.6 s, next waypoint 24.7 s, circle and landing 74.8 s.
    approach = {**waypoint(80, 300, 20), "radius_m": 60}
    landing = land(0, 0, approach={name: approach[name] for name in APPROACH})
    flight = plan("fixed_wing", wing_takeoff(), waypoint(400, 0, 40), waypoint(400, 300, 40), landing)
    own = facts("fixed_wing", firmware=(1, 18, 0), home=HOME, FW_AIRSPD_TRIM=12, FW_AIRSPD_MIN=10)
    timed = [entry.duration_s for entry in predict(flight, own).entries]
    assert timed == [pytest.approx(recorded_s, rel=0.15) for recorded_s in (10.5, 24.6, 24.7, 74.8)]


def test_a_recorded_vtol_delivery_is_predicted_within_15_percent() -> None:
    # 12_vtol_delivery: to the wing and on to the point 24 s, pass 19.5 s, hover 0.7 s, 166 m with a hold of 5 s 40 s.
    flight = plan(
        "vtol",
        takeoff(30, **at(60, 0)),
        waypoint(250, 0, 30),
        transition("multicopter"),
        waypoint(400, 0, 30, hold_s=5, acceptance_radius_m=2),
        transition("fixed_wing"),
        waypoint(400, 250, 30),
        land(0, 0),
    )
    own = facts("vtol", firmware=(1, 18, 0), home=HOME, FW_AIRSPD_TRIM=10.5)
    timed = [entry.duration_s for entry in predict(flight, own).entries]
    recorded = (24.0, 19.5, 0.7, 40.0, 4.8, 20.9, 79.7)
    assert timed == [pytest.approx(recorded_s, rel=0.15, abs=1.0) for recorded_s in recorded]


@pytest.mark.parametrize(
    ("rtl_type", "north_m"),
    [(0, 120), (1, 120), (2, 60), (3, 120), (4, 60), (5, 120)],
)
def test_a_return_goes_where_rtl_type_says(rtl_type: int, north_m: float) -> None:
    """Nearest from 150 m away: the rally point at 120 m; the mission's own landing is at 60 m."""
    point = {name: waypoint(120)[name] for name in ("latitude_deg", "longitude_deg")}
    rally = {**point, "relative_altitude_m": 20}
    flight = plan("multicopter", takeoff(), land(60, 0), waypoint(150), RETURN, rally_points=[rally])
    last = predict(flight, facts(home=HOME, RTL_TYPE=rtl_type)).entries[-1]
    away_m = distance_m(HOME.latitude_deg, HOME.longitude_deg, last.latitude_deg, last.longitude_deg)
    assert away_m == pytest.approx(north_m, abs=0.5)


def test_a_return_goes_home_where_nothing_else_is() -> None:
    for rtl_type in range(6):
        last = predict(multicopter(waypoint()), facts(home=HOME, RTL_TYPE=rtl_type)).entries[-1]
        there = (last.latitude_deg, last.longitude_deg)
        assert distance_m(HOME.latitude_deg, HOME.longitude_deg, *there) == pytest.approx(0.0, abs=0.01)


def test_a_return_along_the_mission_takes_its_corners_back() -> None:
    """Out by a corner 300 m to the north; straight home it would be 300 m to the west."""
    flight = multicopter(waypoint(300), waypoint(300, 300), waypoint(0, 300))
    straight, back = (predict(flight, facts(home=HOME, RTL_TYPE=rtl_type)).entries[-1] for rtl_type in (0, 2))
    assert straight.distance_m == pytest.approx(300.0, abs=20.0)
    assert back.distance_m == pytest.approx(900.0, abs=60.0)
    assert back.uncertainty_s == 0.0


@pytest.mark.parametrize(
    ("vehicle_type", "first", "speed_m_s"),
    [("multicopter", takeoff(), 2.0), ("airship", takeoff(20), 2.0), ("fixed_wing", wing_takeoff(), 12.0)],
)
def test_a_speed_that_is_requested_on_the_ground_is_that_of_the_flight(
    vehicle_type: str, first: Json, speed_m_s: float
) -> None:
    slow = plan(vehicle_type, change_speed(speed_m_s), first, waypoint(600, 0, 40), waypoint(0, 0, 40))
    entries = predict(slow, facts(vehicle_type, home=HOME)).entries
    assert [entry.ground_speed_m_s for entry in entries if entry.type == "waypoint"] == [speed_m_s, speed_m_s]


def test_a_return_is_flown_at_the_vehicles_own_speed_whatever_was_requested() -> None:
    """Only a return along the items repeats the request; the limit of its duration is judged by it."""
    own, slow = multicopter(waypoint(300)), multicopter(waypoint(300), change_speed(2))
    home_s = {rtl: predict(own, facts(home=HOME, RTL_TYPE=rtl)).entries[-1].duration_s for rtl in (0, 2)}
    assert predict(slow, facts(home=HOME, RTL_TYPE=0)).entries[-1].duration_s == pytest.approx(home_s[0], abs=1.0)
    assert predict(slow, facts(home=HOME, RTL_TYPE=2)).entries[-1].duration_s > home_s[2] + 80.0


@pytest.mark.parametrize("vehicle_type", ["fixed_wing", "rover", "airship"])
def test_how_other_types_end_a_return_along_the_mission_is_said_to_be_unsure(vehicle_type: str) -> None:
    first = [] if vehicle_type == "rover" else [takeoff(30, **at(160, 0))]
    flight = plan(vehicle_type, *first, waypoint(300), RETURN)
    last = predict(flight, facts(vehicle_type, home=HOME, RTL_TYPE=2)).entries[-1]
    assert last.uncertainty_s == last.start_s > 0.0


def test_a_headwind_makes_a_pass_slower_and_its_lead_shorter() -> None:
    flight = fixed_wing(waypoint(400), gripper("moving"), waypoint(600))
    own = facts("fixed_wing", firmware=(1, 18, 0), home=HOME)
    (calm,), (against,) = predict(flight, own).drops, predict(flight, own, Wind(north_m_s=-5.0)).drops
    assert against.at_s > calm.at_s + 3.0
    assert against.lead_m == pytest.approx(calm.lead_m * 10 / 15, rel=0.05)


def test_what_cannot_be_predicted_is_said() -> None:
    """PX4 bobs at a waypoint that it flies through before a change of height."""
    unsure = {
        entry.item_id: entry.uncertainty_s
        for entry in _timeline(multicopter(waypoint(100), waypoint(200, 0, 40))).entries
    }
    assert unsure["item-2"] > 0.0
    assert unsure["item-1"] == 0.0
    level = _timeline(multicopter(waypoint(100), waypoint(200)))
    assert {entry.uncertainty_s for entry in level.entries} == {0.0}


@given(st.floats(1, 2000), st.floats(0.5, 12), st.floats(0, 12), st.floats(0, 12))
def test_a_longer_way_never_takes_less_time(way_m: float, top_m_s: float, start_m_s: float, final_m_s: float) -> None:
    limits = TrajectoryLimits(top_m_s, 3.0, 4.0)
    start, final = min(start_m_s, top_m_s), min(final_m_s, top_m_s)
    times = [travel_s(way_m * share, limits, start_m_s=start, final_m_s=final) for share in (0.25, 0.5, 1.0)]
    assert all(seconds >= 0.0 for seconds in times)
    assert times[1] <= times[2] + 1e-6
    assert times[2] >= way_m / top_m_s - 1e-6


@pytest.mark.parametrize("vehicle_type", ["multicopter", "fixed_wing", "vtol", "rover", "airship"])
@pytest.mark.parametrize("end", [RETURN, land()], ids=["return", "land"])
def test_what_is_left_of_a_flight_goes_on_at_its_speed_when_it_is_only_the_end(vehicle_type: str, end: Json) -> None:
    whole = plan(vehicle_type, *_start_of(vehicle_type), waypoint(500), waypoint(1000), end)
    rest = whole.model_copy(update={"items": whole.items[-1:]})
    known = facts(vehicle_type)
    there = at(1000, 0)
    here = InFlight(**there, relative_altitude_m=30.0, ground_speed_m_s=0.0, wing_borne=vehicle_type == "vtol")
    left = predict(rest, replace(known, in_flight=here)).duration_s
    assert left == pytest.approx(predict(whole, known).entries[-1].duration_s, rel=0.3, abs=15.0)


@pytest.mark.parametrize("vehicle_type", ["multicopter", "vtol", "airship"])
def test_a_return_from_a_landing_in_mid_plan_is_flown_as_fast_as_any(vehicle_type: str) -> None:
    landed = plan(vehicle_type, *_start_of(vehicle_type), waypoint(500), land(500), RETURN)
    assert predict(landed, facts(vehicle_type)).entries[-1].duration_s < 200.0


def _start_of(vehicle_type: str) -> list[Json]:
    starts = {"fixed_wing": [wing_takeoff()], "rover": [], "vtol": [takeoff(30, **at(60, 0))]}
    return starts.get(vehicle_type, [takeoff()])
