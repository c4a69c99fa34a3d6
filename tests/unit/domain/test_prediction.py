"""The prediction says when, how far and where each drop acts; recorded PX4 flights are its measure."""

from __future__ import annotations

import pytest

from app.domain.default_facts import default_facts
from app.domain.geo import distance_m
from app.domain.plan import Plan
from app.domain.prediction import PredictedDrop, Timeline, predict
from tests.unit.domain.plan_pieces import (
    HOME,
    RETURN,
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
)


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
    # Recorded: takeoff to 15 m 11.8 s, 60 m to a stop 17.5 s, hold 5 s, delay 2 s, 45 m 9.0 s, return 53 s.
    flight = multicopter(waypoint(60, 0, 15, hold_s=5), gripper(mode="embedded"), waypoint(60, 45, 15), home=None)
    timeline = predict(flight, facts(home=HOME))
    takeoff_s, drop_s, gripper_s, last_s, return_s = (entry.duration_s for entry in timeline.entries)
    assert takeoff_s == pytest.approx(11.8, rel=0.15)
    assert drop_s == pytest.approx(22.5, rel=0.15)
    assert gripper_s == pytest.approx(2.0, rel=0.15)
    assert last_s == pytest.approx(10.0, rel=0.15)
    assert return_s == pytest.approx(53, rel=0.15)


def test_a_drop_that_asks_is_predicted_with_the_slowest_answer() -> None:
    def drop_s(**asks: object) -> float:
        return _timeline(multicopter(waypoint(), gripper(hold_s=40, **asks))).entries[2].duration_s

    assert drop_s(consent="operator", consent_timeout_s=20) == pytest.approx(drop_s() + 20.0)
    assert drop_s(consent="operator") == pytest.approx(drop_s() + 35.0), "as long as the hold allows"


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
    assert (drop.lead_m, drop.ground_speed_m_s, drop.throw_m) == (1.0, 0.0, 0.0)


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
    assert drop.fall_s == pytest.approx(3.03, abs=0.01)
    assert drop.throw_m == pytest.approx(45.4, abs=0.1)


def test_a_drop_from_a_circle_is_one_radius_away_and_nobody_knows_where() -> None:
    drop = _drop(fixed_wing(loiter(radius_m=-70), gripper("moving")))
    assert (drop.offset_m, drop.release_latitude_deg) == (70, None)


def test_a_recorded_rover_reaches_its_waypoint_1_3_m_early_and_stops_at_it() -> None:
    assert _drop(rover(waypoint(30, 0, 0), gripper("moving"))).lead_m == 1.3
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
