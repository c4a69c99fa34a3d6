"""A waypoint that follows the moving target of its drop: when it is moved, and what is recorded if it cannot be."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

from app.domain.drop.record import DropPhase
from app.domain.events.run import RunTargetNotFollowed
from app.domain.flight.inputs import MoveWaypoint, Observation
from app.domain.flight.segment import MissionSegment
from app.domain.plan.intercept import FollowingDrop, NoAim, aim, follower_at
from app.domain.reasons import Reason
from app.domain.run.mission_change import FRESH_POSITION_S
from app.domain.run.run import Run, RunState
from app.domain.vehicle.state import VehicleState

AIM_EVERY_S: Final = 1.0
MOVE_EVERY_S: Final = 5.0
"""Time between two attempts: an upload takes seconds on a slow link."""
MOVE_FROM_M: Final = 3.0
"""A waypoint that is nearer to where it should be stays; half of the drop's max_offset_m if that is less."""


@dataclass(frozen=True, slots=True)
class TargetTracker:
    """When the waypoint was last aimed and moved (our monotonic seconds).

    `refused` is the code of the reason for which it was last recorded not to follow; None while it follows.
    """

    aimed_s: float | None = None
    moved_s: float | None = None
    refused: str | None = None

    def is_due(self, now_s: float) -> bool:
        """Whether to aim again."""
        aimed = self.aimed_s is not None and now_s - self.aimed_s < AIM_EVERY_S
        moved = self.moved_s is not None and now_s - self.moved_s < MOVE_EVERY_S
        return not (aimed or moved)

    def follow(
        self, run: Run, segment: MissionSegment, observed: Observation, clock_rate: float, default_offset_m: float
    ) -> tuple[TargetTracker, MoveWaypoint | RunTargetNotFollowed | None]:
        """Aim at the target of the waypoint that is flown to, if it has one.

        `clock_rate`: the target moves in our time, a simulated vehicle perhaps in a faster one.
        """
        follower = follower_at(segment.plan, run.item_id) if is_free(run) and self.is_due(observed.now_s) else None
        if follower is None or run.drop(follower.drop.id).phase is not DropPhase.WAITING:
            return self, None
        place, speed_m_s = _place(observed.state), segment.approach_speeds_m_s.get(follower.waypoint.id)
        if place is None or speed_m_s is None:
            return self, None
        tracker = replace(self, aimed_s=observed.now_s)
        fix = observed.targets.get(follower.target.feed)
        wanted = aim(follower.target, follower.planned, fix, place, speed_m_s * clock_rate)
        if isinstance(wanted, NoAim):
            return tracker.not_followed(follower, observed, wanted.reason)
        nearest_m = min(MOVE_FROM_M, (follower.drop.max_offset_m or default_offset_m) / 2)
        if fix is None or follower.distance_m(wanted.latitude_deg, wanted.longitude_deg) < nearest_m:
            return replace(tracker, refused=None), None
        move = MoveWaypoint(
            plan_item_id=follower.drop.id,
            waypoint_id=follower.waypoint.id,
            latitude_deg=wanted.latitude_deg,
            longitude_deg=wanted.longitude_deg,
            after_s=wanted.after_s,
            moved_m=wanted.moved_m,
            fix=fix,
        )
        return replace(tracker, moved_s=observed.now_s), move

    def not_followed(
        self, follower: FollowingDrop, observed: Observation, reason: Reason
    ) -> tuple[TargetTracker, RunTargetNotFollowed | None]:
        """The waypoint stays where it is: recorded once for each code."""
        code = str(reason.params.get("error", reason.code.value))
        if self.refused == code:
            return self, None
        fix, state = observed.targets.get(follower.target.feed), observed.state
        event = RunTargetNotFollowed(
            plan_item_id=follower.drop.id,
            waypoint_id=follower.waypoint.id,
            feed=follower.target.feed,
            reason=reason,
            target=None if fix is None else fix.evidence(state.latitude_deg, state.longitude_deg),
        )
        return replace(self, refused=code), event


def is_free(run: Run) -> bool:
    """Whether nothing else determines where the run flies."""
    return run.state is RunState.FLYING and run.commanded is None and run.changing is None


def _place(state: VehicleState) -> tuple[float, float] | None:
    if state.latitude_deg is None or state.longitude_deg is None or state.position_age_s is None:
        return None
    return (state.latitude_deg, state.longitude_deg) if state.position_age_s <= FRESH_POSITION_S else None
