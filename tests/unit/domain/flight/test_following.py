"""A waypoint follows the moving target of its drop: aimed at once a second, moved when it is worth it, told once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest

from app.domain.events.run import RunTargetNotFollowed
from app.domain.flight.following import MOVE_EVERY_S, TargetTracker
from app.domain.flight.inputs import MoveWaypoint, Observation
from app.domain.flight.segment import drop_records, segment_of
from app.domain.geo import LocalProjection
from app.domain.plan.compiler import compile_plan
from app.domain.plan.intercept import SETTLE_S, approach_speeds_m_s
from app.domain.run.run import Run, RunAction, RunState
from app.domain.targets import TargetFix, TargetReport
from app.domain.vehicle.state import VehicleState
from tests.support.plan_pieces import at, facts, multicopter, waypoint
from tests.support.target_cases import chase

PLAN = multicopter(waypoint(50, id="a"), waypoint(200, id="b", speed_m_s=5), chase(max_move_m=40))
MISSION = compile_plan(PLAN, facts())
NEW = Run(id="r", plan_id="p", plan_hash="h", vehicle_id="v1", created_at=0.0, updated_at=0.0)
FLYING = NEW.model_copy(update={"state": RunState.FLYING, "item_id": "b", "drops": drop_records(MISSION)})
SEGMENT = segment_of(FLYING, PLAN, MISSION, 3.0, approach_speeds_m_s(PLAN, facts()))


def ship(east_m: float, age_s: float = 0.0, north_m_s: float = 0.0) -> TargetFix:
    """So far east of the planned point."""
    place = at(200, 0)
    latitude_deg, longitude_deg = LocalProjection(place["latitude_deg"], place["longitude_deg"]).to_global(east_m, 0.0)
    report = TargetReport(
        latitude_deg=latitude_deg, longitude_deg=longitude_deg, north_m_s=north_m_s, east_m_s=0.0, time=0.0
    )
    return TargetFix("ship-1", report, age_s)


@dataclass
class Follower:
    """Observes once a second."""

    run: Run = FLYING
    rate: float = 1.0
    now_s: float = 1000.0
    tracker: TargetTracker = field(default_factory=TargetTracker)

    def sees(self, fix: TargetFix | None, after_s: float = 1.0) -> MoveWaypoint | RunTargetNotFollowed | None:
        self.now_s += after_s
        state = VehicleState(connected=True, **at(100, 0), position_age_s=0.1)
        targets = {} if fix is None else {"ship-1": fix}
        observed = Observation(state, self.now_s, 1e9, targets)
        self.tracker, effect = self.tracker.follow(self.run, SEGMENT, observed, self.rate, 3.0)
        return effect


def code_of(effect: MoveWaypoint | RunTargetNotFollowed | None) -> str | None:
    return effect.reason.code.value if isinstance(effect, RunTargetNotFollowed) else None


def test_the_waypoint_is_moved_to_the_target_and_not_again_within_seconds() -> None:
    follower = Follower()
    move = follower.sees(ship(10))
    assert isinstance(move, MoveWaypoint)
    assert (move.plan_item_id, move.waypoint_id) == (MISSION.drops[0].plan_item_id, "b")
    assert move.moved_m == pytest.approx(10, abs=0.1)
    assert [follower.sees(ship(20)) for _ in range(int(MOVE_EVERY_S) - 1)] == [None] * (int(MOVE_EVERY_S) - 1)
    assert isinstance(follower.sees(ship(20)), MoveWaypoint)


def test_it_is_aimed_at_once_a_second() -> None:
    follower = Follower()
    assert follower.sees(ship(0)) is None
    assert follower.sees(ship(20), after_s=0.5) is None
    assert isinstance(follower.sees(ship(20), after_s=0.5), MoveWaypoint)


@pytest.mark.parametrize(
    ("fix", "code"),
    [
        (None, "target.feed_silent"),
        (ship(0, age_s=60), "target.stale"),
        (ship(41), "target.out_of_bounds"),
        (ship(0, north_m_s=3), "target.too_fast"),
    ],
)
def test_a_target_that_cannot_be_followed_is_recorded_once(fix: TargetFix | None, code: str) -> None:
    follower = Follower()
    assert [code_of(follower.sees(fix)) for _ in range(3)] == [code, None, None]


def test_a_target_that_is_lost_or_jumps_away_is_followed_again_when_it_is_back() -> None:
    follower = Follower()
    assert code_of(follower.sees(ship(2, age_s=6))) == "target.stale"
    assert code_of(follower.sees(ship(41))) == "target.out_of_bounds"
    assert follower.sees(ship(1000)) is None, "the same code"
    assert isinstance(follower.sees(ship(15)), MoveWaypoint)


def test_a_refused_move_is_recorded_once_for_each_code_until_it_follows() -> None:
    follower = Follower()
    assert code_of(follower.sees(ship(41))) == "target.out_of_bounds"
    assert follower.sees(ship(1)) is None, "near enough: it follows"
    assert code_of(follower.sees(ship(41))) == "target.out_of_bounds"


def test_a_small_move_another_item_a_pause_and_a_change_move_nothing() -> None:
    assert Follower().sees(ship(0.9)) is None
    for other in ({"item_id": "a"}, {"commanded": RunAction.PAUSE}, {"state": RunState.PAUSED}):
        assert Follower(run=FLYING.model_copy(update=other)).sees(ship(10)) is None
    held = replace(SEGMENT, approach_speeds_m_s={})
    observed = Observation(VehicleState(connected=True, **at(100, 0), position_age_s=9.0), 1000.0, 1e9, {})
    assert TargetTracker().follow(FLYING, held, observed, 1.0, 3.0)[1] is None, "its position is old"


@pytest.mark.parametrize("rate", [1.0, 4.0])
def test_the_target_is_met_in_our_time_however_fast_the_vehicles_clock_runs(rate: float) -> None:
    move = Follower(rate=rate).sees(ship(10))
    assert isinstance(move, MoveWaypoint)
    way_m = (100**2 + 10**2) ** 0.5
    assert move.after_s == pytest.approx(SETTLE_S + way_m / 5 / rate, abs=0.1)
