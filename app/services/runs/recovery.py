"""After a restart of ours: find the vehicle of an open run, and go on where it is now."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import structlog

from app.domain.drop.record import Certainty, DropOutcome, DropPhase, DropRecord
from app.domain.drop.supervised_inputs import GRIPPER_OPEN_US
from app.domain.errors import LinkError, NotFoundError, VehicleQuarantinedError
from app.domain.events.run import RunChanged, RunMissionChanged
from app.domain.flight.inputs import TakenUp
from app.domain.flight.leg import changed_to
from app.domain.flight.supervised_release import withdrawn
from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.ports.stores import FlightLog
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.prediction import CALM, Timeline, predict
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.remaining_mission import rest_of
from app.domain.run.run import PlanChange, Run, RunState
from app.domain.vehicle.state import VehicleProfile
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.plans import KnownPlans
from app.services.runs.flight import Assembled, assemble
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RECORDED_VISITS, RunSettings
from app.services.targets import Targets

# Ends a run whose vehicle cannot be looked at: each drop gets the outcome that its record allows.


BEFORE_TAKE_OFF = frozenset({RunState.CREATED, RunState.UPLOADING, RunState.UPLOADED})


async def close_unseen(run: Run, state: RunState, reason: Reason, journal: Journal, clock: Clock) -> Run:
    """Store the run's end. Raises StorageError."""
    recorder = RunRecorder(run, journal, clock)
    for drop in run.drops:
        if drop.phase is not DropPhase.DONE:
            recorder.drop(closed(drop, reason, took_off=run.state not in BEFORE_TAKE_OFF))
    recorder.change(item_id=None)
    recorder.move(state, reason)
    return await recorder.flush()


def closed(drop: DropRecord, reason: Reason, *, took_off: bool) -> DropRecord:
    """A supervised drop that was never commanded is kept; an embedded one may have happened unseen.

    One whose output was seen at release is never kept.
    """
    outcome, certainty = DropOutcome.UNKNOWN, Certainty.NONE
    if drop.output_us == GRIPPER_OPEN_US:
        if drop.commanded_at is not None:
            outcome, certainty = DropOutcome.RELEASED, Certainty.INFERRED
            reason = Reason.of(ReasonCode.DROP_ACK_MISSING_RELEASED_THEN, reason)
    elif not took_off or (drop.supervised and drop.attempts == 0):
        outcome, certainty = DropOutcome.KEPT, Certainty.INFERRED
    changes: dict[str, object] = {"phase": DropPhase.DONE, "outcome": outcome, "certainty": certainty, "reason": reason}
    if drop.consent is not None and drop.attempts == 0:
        changes["consent"] = withdrawn(drop.consent, reason)
    return drop.model_copy(update=changes)


# Which mission of a run a vehicle carries that was found again: the newest, or a change that was on its way to it.


WHILE_AWAY = Reason.of(ReasonCode.PLAN_CHANGED_WHILE_AWAY)


@dataclass(frozen=True, slots=True)
class OnboardMission:
    """`run` is as it is with this mission on board; `arrived` and `timeline` if that is news."""

    run: Run
    plan: Plan
    mission: Mission
    arrived: PlanChange | None = None
    timeline: Timeline | None = None

    def tell(self, recorder: RunRecorder) -> None:
        """Record what a restart has shown of a change."""
        if self.arrived is not None and self.timeline is not None:
            recorder.note(RunMissionChanged(change=self.arrived, timeline=self.timeline))
            recorder.note(RunChanged(self.run))
        else:
            recorder.change(changing=None)


def carried_as_told(
    run: Run, plan: Plan, facts: VehicleProfile, on_board: Sequence[MissionItem], mission_id: int | None
) -> OnboardMission | None:
    """The run's own mission, if the vehicle carries it."""
    mission = compiled(plan, run.change, facts)
    named = run.mission_id is not None and mission_id == run.mission_id
    held = _held(mission, on_board, named=named)
    return None if held is None else OnboardMission(run, plan, held)


def carried_change(
    run: Run,
    change: PlanChange,
    plan: Plan,
    facts: VehicleProfile,
    on_board: Sequence[MissionItem],
    mission_id: int | None,
) -> OnboardMission | None:
    """The mission of a change that nobody saw arrive, if the vehicle carries it."""
    mission = compiled(plan, change, facts)
    held = _held(mission, on_board, named=mission_id == change.mission_id)
    if held is None:
        return None
    ahead = {drop.plan_item_id for drop in mission.drops}
    drops = tuple(
        closed(drop, WHILE_AWAY, took_off=True)
        if drop.phase is not DropPhase.DONE and drop.plan_item_id not in ahead
        else drop
        for drop in run.drops
    )
    run = run.model_copy(update={"drops": drops})
    run = run.model_copy(update=changed_to(run, change, mission))
    rest = rest_of(plan, change.continue_at, change.left_out)
    timeline = predict(rest.plan, replace(facts, in_flight=change.began), run.wind or CALM).first(RECORDED_VISITS)
    return OnboardMission(run, plan, held, change, timeline)


def compiled(plan: Plan, change: PlanChange | None, facts: VehicleProfile) -> Mission:
    """The mission as it was uploaded: whole, or what was left of the plan when it was changed in flight."""
    if change is None:
        return compile_plan(plan, facts)
    rest = rest_of(plan, change.continue_at, change.left_out)
    return compile_plan(rest.plan, replace(facts, in_flight=change.began))


def _held(mission: Mission, on_board: Sequence[MissionItem], *, named: bool) -> Mission | None:
    """The mission as the vehicle has it, by its id or item by item; None if it carries another."""
    if [item.command for item in on_board] != [item.command for item in mission.items]:
        return None
    if named:
        return replace(mission, items=tuple(on_board))  # as uploaded, though a parameter or home changed since
    same = all(a.same_as(b) for a, b in zip(mission.items, on_board, strict=True))
    return mission if same else None


log = structlog.get_logger(__name__)
NOT_STARTED = frozenset({RunState.CREATED, RunState.UPLOADING})
LOOK_AGAIN_S = 0.25


class RunRecovery:
    """Never starts anything: it looks at what the vehicle does, and lets the run follow."""

    def __init__(
        self,
        fleet: Fleet,
        plans: KnownPlans,
        journal: Journal,
        settings: RunSettings,
        clock: Clock,
        targets: Targets,
        log: FlightLog,
    ) -> None:
        self._fleet = fleet
        self._plans = plans
        self._journal = journal
        self._settings = settings
        self._clock = clock
        self._targets = targets
        self._log = log

    async def find(self, run: Run) -> Assembled | None:
        """The flight to go on with; None if the run had to be ended, with its reason recorded."""
        plan = await self._plan(run.plan_id)
        link = None if run.state in NOT_STARTED else await self._vehicle(run)
        if plan is None or link is None:
            await self._give_up(run)
            return None
        carried = await self._carried(run, plan, link) if _is_same_vehicle(run, link) else None
        if carried is None:
            await self._give_up(run, ReasonCode.OTHER_MISSION_ON_BOARD)
            return None
        if run.state is RunState.STARTING and not link.state().armed:
            await self._give_up(run, ReasonCode.RESTART_DURING_START_DISARMED)
            return None
        run, plan, mission = carried.run, carried.plan, carried.mission
        facts = partial(self._fleet.facts, run.vehicle_id)
        then = await facts()
        made = assemble(
            run, plan, mission, link, then, facts, self._journal, self._settings, self._clock, self._targets, self._log
        )
        carried.tell(made.recorder)
        if run.state is RunState.STARTING:
            made.recorder.move(RunState.FLYING, Reason.of(ReasonCode.RESTART_DURING_START_ARMED))
        if run.state is not RunState.UPLOADED:
            watch = made.watch
            watch.feed(TakenUp(watch.sight(), run.flown_item_ids, link.state().mission_seq))
        return made

    async def _plan(self, plan_id: str) -> Plan | None:
        try:
            return await self._plans.plan(plan_id)
        except NotFoundError:
            return None

    async def _vehicle(self, run: Run) -> VehicleLink | None:
        """Wait for the vehicle to be seen, with its identity and mission known."""
        deadline_s = self._clock.monotonic() + self._settings.lost_after_s
        while self._clock.monotonic() < deadline_s:
            try:
                link = self._fleet.link(run.vehicle_id)
            except (NotFoundError, VehicleQuarantinedError):
                link = None
            if link is not None and _is_known(link):
                return link
            await asyncio.sleep(LOOK_AGAIN_S)
        return None

    async def _carried(self, run: Run, plan: Plan, link: VehicleLink) -> OnboardMission | None:
        """What the vehicle carries: the run's mission, or the one that was on its way to it; None if another."""
        facts, on_board = await self._read(run.vehicle_id, link)
        mission_id = link.state().mission_id
        is_news = run.changing is not None and run.changing.mission_id != run.mission_id
        if is_news and run.changing is not None and (changed := await self._plan(run.changing.plan_id)) is not None:
            carried = carried_change(run, run.changing, changed, facts, on_board, mission_id)
            if carried is not None:
                return carried
        return carried_as_told(run, plan, facts, on_board, mission_id)

    async def _read(self, vehicle_id: str, link: VehicleLink) -> tuple[VehicleProfile, tuple[MissionItem, ...]]:
        """Raises LinkError if the vehicle does not answer for too long."""
        deadline_s = self._clock.monotonic() + self._settings.lost_after_s
        while True:
            try:
                return await self._fleet.facts(vehicle_id), await link.download(MissionType.MISSION)
            except LinkError as error:
                if self._clock.monotonic() >= deadline_s:
                    raise
                log.warning("the vehicle's mission cannot be read yet", error=error.detail)
                await asyncio.sleep(1.0)

    async def _give_up(self, run: Run, code: ReasonCode = ReasonCode.NOT_SEEN_AFTER_RESTART) -> None:
        """End a run that cannot be followed. What was commanded and not answered stays unknown."""
        if run.state in NOT_STARTED:
            code = ReasonCode.RESTART_BEFORE_UPLOAD_ENDED
        state = RunState.LOST if code is ReasonCode.NOT_SEEN_AFTER_RESTART else RunState.FAILED
        await close_unseen(run, state, Reason.of(code), self._journal, self._clock)


def _is_known(link: VehicleLink) -> bool:
    state = link.state()
    return state.connected and state.mode is not None and state.armed is not None and link.identity.uid is not None


def _is_same_vehicle(run: Run, link: VehicleLink) -> bool:
    return run.vehicle_uid is None or link.identity.uid == run.vehicle_uid
