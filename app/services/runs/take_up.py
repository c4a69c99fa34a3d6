"""After a restart of ours: find the vehicle of an open run, and go on where it is now."""

from __future__ import annotations

import asyncio
from functools import partial

import structlog

from app.domain.errors import LinkError, NotFoundError, VehicleQuarantinedError
from app.domain.flight.inputs import TakenUp
from app.domain.flight.log_port import FlightLog
from app.domain.mission import MissionItem, MissionType
from app.domain.plan import Plan
from app.domain.ports import VehicleLink
from app.domain.reason import ReasonCode, because
from app.domain.run import Run, RunState
from app.domain.vehicle import VehicleFacts
from app.services.clock import Clock
from app.services.fleet import Fleet
from app.services.journal import Journal
from app.services.known_plans import KnownPlans
from app.services.runs.assembly import Assembled, assemble
from app.services.runs.carried import Carried, carried_as_told, carried_change
from app.services.runs.closing import close_unseen
from app.services.runs.settings import RunSettings
from app.services.targets import Targets

log = structlog.get_logger(__name__)
NOT_STARTED = frozenset({RunState.CREATED, RunState.UPLOADING})
LOOK_AGAIN_S = 0.25


class TakeUp:
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
            made.recorder.move(RunState.FLYING, because(ReasonCode.RESTART_DURING_START_ARMED))
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

    async def _carried(self, run: Run, plan: Plan, link: VehicleLink) -> Carried | None:
        """What the vehicle carries: the run's mission, or the one that was on its way to it; None if another."""
        facts, on_board = await self._read(run.vehicle_id, link)
        mission_id = link.state().mission_id
        is_news = run.changing is not None and run.changing.mission_id != run.mission_id
        if is_news and run.changing is not None and (changed := await self._plan(run.changing.plan_id)) is not None:
            carried = carried_change(run, run.changing, changed, facts, on_board, mission_id)
            if carried is not None:
                return carried
        return carried_as_told(run, plan, facts, on_board, mission_id)

    async def _read(self, vehicle_id: str, link: VehicleLink) -> tuple[VehicleFacts, tuple[MissionItem, ...]]:
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
        await close_unseen(run, state, because(code), self._journal, self._clock)


def _is_known(link: VehicleLink) -> bool:
    state = link.state()
    return state.connected and state.mode is not None and state.armed is not None and link.identity.uid is not None


def _is_same_vehicle(run: Run, link: VehicleLink) -> bool:
    return run.vehicle_uid is None or link.identity.uid == run.vehicle_uid
