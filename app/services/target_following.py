"""Moves the waypoint of a drop after its moving target, while a run is on its way there, by changes of its plan."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import dataclass
from typing import Final

import structlog

from app.domain.drop.record import DropPhase
from app.domain.errors import StorageError, WaydropError
from app.domain.events.run import Place, RunTargetMoved, RunTargetNotFollowed
from app.domain.plan import Plan
from app.domain.plan.intercept import Aim, FollowingDrop, NoAim, aim, follower_at, moved, speed_towards_m_s
from app.domain.reasons import Reason
from app.domain.run.mission_change import FRESH_POSITION_S
from app.domain.run.run import Run, RunState
from app.domain.targets import TargetEvidence, TargetFix
from app.domain.vehicle.state import VehicleState
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.plans import Plans
from app.services.runs import Runs, RunSettings
from app.services.targets import Targets

log = structlog.get_logger(__name__)

LOOK_EVERY_S: Final = 1.0
MOVE_EVERY_S: Final = 5.0
"""Between two tries for one run: an upload takes seconds of a slow link."""
MOVE_FROM_M: Final = 3.0
"""A waypoint that is nearer to where it should be stays; half of the drop's max_offset_m if that is less."""
DEFAULT_OFFSET_M: Final = RunSettings().default_max_offset_m


@dataclass(slots=True)
class _Followed:
    """What is remembered of one run: its plan, its vehicle's parameters, the last try, the last code told."""

    plan_id: str = ""
    plan: Plan | None = None
    tried_s: float | None = None
    told: str = ""


class TargetFollower:
    """Looks at all runs once a second. It commands nothing itself: each move is a changed plan of the run."""

    def __init__(
        self, runs: Runs, plans: Plans, fleet: Fleet, targets: Targets, journal: Journal, clock: Clock
    ) -> None:
        self._runs = runs
        self._plans = plans
        self._fleet = fleet
        self._targets = targets
        self._journal = journal
        self._clock = clock
        self._followed: dict[str, _Followed] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}
        self._loop: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin to look."""
        self._loop = asyncio.create_task(self._look_on(), name="moving targets")

    async def close(self) -> None:
        """Stop. A change that is under way is broken off. Idempotent."""
        tasks = [*self._tasks.values(), *([] if self._loop is None else [self._loop])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def look(self) -> None:
        """Look once at every open run, and wait for what comes of it."""
        self._begin()
        await asyncio.gather(*self._tasks.values())

    async def _look_on(self) -> None:
        while True:
            self._begin()
            await asyncio.sleep(LOOK_EVERY_S)

    def _begin(self) -> None:
        """One task for each run, so that a slow upload keeps no other run from its target."""
        runs = {run.id: run for run in self._runs.open_runs() if not run.is_over}
        for gone in self._followed.keys() - runs.keys():
            del self._followed[gone]
        for run in runs.values():
            if run.id not in self._tasks:
                task = asyncio.create_task(self._follow(run), name=f"target of {run.id}")
                self._tasks[run.id] = task
                task.add_done_callback(lambda _, run_id=run.id: self._tasks.pop(run_id, None))  # type: ignore[misc]

    async def _follow(self, run: Run) -> None:
        followed = self._followed.setdefault(run.id, _Followed())
        now_s = self._clock.monotonic()
        if not _is_free(run) or (followed.tried_s is not None and now_s - followed.tried_s < MOVE_EVERY_S):
            return
        try:
            await self._try(run, followed, now_s)
        except WaydropError as error:  # the vehicle is not seen, or does not answer: a later look tries again
            followed.tried_s = now_s
            log.info("a target cannot be followed now", run_id=run.id, error=error.detail)

    async def _try(self, run: Run, followed: _Followed, now_s: float) -> None:
        plan = await self._plans.plan(run.plan_id)
        follower = follower_at(plan, run.item_id)
        if follower is None or run.drop(follower.drop.id).phase is not DropPhase.WAITING:
            return
        state = self._fleet.link(run.vehicle_id).state()
        place = _place(state)
        if place is None:
            return
        fix = self._targets.fixes([follower.target.feed]).get(follower.target.feed)
        facts = await self._fleet.link(run.vehicle_id).read_facts()
        speed_m_s = speed_towards_m_s(plan, facts, follower.waypoint.id)
        speed_m_s *= state.clock.sure_rate  # the target moves in our time, a simulated vehicle perhaps in a faster one
        wanted = aim(follower.target, follower.planned, fix, place, speed_m_s)
        if isinstance(wanted, NoAim):
            await self._tell_not_followed(run, followed, follower, fix, wanted.reason)
            return
        away_m = follower.distance_m(wanted.latitude_deg, wanted.longitude_deg)
        if fix is None or away_m < min(MOVE_FROM_M, (follower.drop.max_offset_m or DEFAULT_OFFSET_M) / 2):
            followed.told = ""
            return
        followed.tried_s = now_s
        try:
            await self._move(run, followed, follower, fix, wanted)
        except WaydropError as error:
            await self._tell_not_followed(run, followed, follower, fix, Reason.of_error(error.code, error.detail))

    async def _move(self, run: Run, followed: _Followed, follower: FollowingDrop, fix: TargetFix, to: Aim) -> None:
        plan = moved(await self._plans.plan(run.plan_id), follower, to.latitude_deg, to.longitude_deg)
        actor = f"target {follower.target.feed}"
        new = await self._plans.checked(plan, actor)
        now = await self._runs.get(run.id)
        if now.changes != run.changes or not _is_free(now):
            return  # a person decided otherwise meanwhile: the next look sees what is flown now
        await self._runs.change_mission(run.id, new, None, actor, needed=(follower.waypoint.id, follower.drop.id))
        followed.told = ""
        waypoint = follower.waypoint
        await self._tell(
            run,
            RunTargetMoved(
                plan_item_id=follower.drop.id,
                waypoint_id=waypoint.id,
                plan_id=new.stored.id,
                moved_from=Place(latitude_deg=waypoint.latitude_deg, longitude_deg=waypoint.longitude_deg),
                moved_to=Place(latitude_deg=to.latitude_deg, longitude_deg=to.longitude_deg),
                from_planned_m=to.moved_m,
                after_s=to.after_s,
                target=self._evidence(run, fix),
            ),
        )

    async def _tell_not_followed(
        self, run: Run, followed: _Followed, follower: FollowingDrop, fix: TargetFix | None, reason: Reason
    ) -> None:
        code = str(reason.params.get("error", reason.code))
        if followed.told == code:
            return
        followed.told = code
        await self._tell(
            run,
            RunTargetNotFollowed(
                plan_item_id=follower.drop.id,
                waypoint_id=follower.waypoint.id,
                feed=follower.target.feed,
                reason=reason,
                target=None if fix is None else self._evidence(run, fix),
            ),
        )

    async def _tell(self, run: Run, told: RunTargetMoved | RunTargetNotFollowed) -> None:
        event = self._journal.new_event(told, vehicle_id=run.vehicle_id, run_id=run.id)
        with contextlib.suppress(StorageError):  # logged by the journal; the changed plan itself is stored
            await self._journal.record(event)

    def _evidence(self, run: Run, fix: TargetFix) -> TargetEvidence:
        state = self._fleet.link(run.vehicle_id).state()
        return fix.evidence(state.latitude_deg, state.longitude_deg)


def _is_free(run: Run) -> bool:
    """Nobody else decides now where the run flies."""
    return run.state is RunState.FLYING and run.asked is None and run.changing is None


def _place(state: VehicleState) -> tuple[float, float] | None:
    if state.latitude_deg is None or state.longitude_deg is None or state.position_age_s is None:
        return None
    return (state.latitude_deg, state.longitude_deg) if state.position_age_s <= FRESH_POSITION_S else None
