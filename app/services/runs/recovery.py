"""After a restart of ours: find the vehicle of an open run, and go on where it is now."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

import structlog

from app.domain.errors import LinkError, NotFoundError, StorageError, VehicleQuarantinedError
from app.domain.events.run import RunChanged, RunCommand, RunCommandName
from app.domain.flight.inputs import Observation, Recovered
from app.domain.flight.recovery import (
    CarriedItems,
    OnboardMission,
    as_before_unread,
    carried_mission,
    compile_uploaded,
    ended_unread,
    ended_unseen,
    taken_over,
    unread,
)
from app.domain.mission import MissionItem, MissionType
from app.domain.plan import Plan
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import IN_FLIGHT, Run, RunState
from app.domain.run.run import NOT_STARTED as UNSTARTED
from app.domain.vehicle.state import VehicleState
from app.services.fleet import Fleet
from app.services.runs.assembly import AssembledFlight, FlightParts, assemble, begun_flight
from app.services.runs.disarming import leave_in_hold
from app.services.runs.recorder import RunRecorder

log = structlog.get_logger(__name__)
NOT_STARTED = frozenset({RunState.CREATED, RunState.UPLOADING})
POLL_S = 0.25
AGAIN_S = 1.0
EVENTS_AT_ONCE = 500
UNREAD_TRIES = 4
"""Of reading the mission, before a run is judged without it."""
MOST_AGAIN_S = 10.0
"""A vehicle that does not answer is asked again after AGAIN_S, then after twice as long each time, up to this."""
ITEM_KNOWN_S = 3.0
"""MISSION_CURRENT has a rate of 1 Hz."""
_ENDS: Final[Mapping[ReasonCode, RunState]] = {
    ReasonCode.NOT_SEEN_AFTER_RESTART: RunState.LOST,
    ReasonCode.ABORTED_ON_GROUND: RunState.ABORTED,
    ReasonCode.ABORTED_UNREAD: RunState.ABORTED,
}


class RunRecovery:
    """Never starts anything: it observes what the vehicle does, and lets the run follow. `is_withdrawn`: whether a run
    that is not followed is to end: one that was not started, or whose mission is not read.
    """

    def __init__(self, fleet: Fleet, parts: FlightParts, is_withdrawn: Callable[[str], bool]) -> None:
        self._fleet = fleet
        self._parts = parts
        self._is_withdrawn = is_withdrawn

    async def found(self, run: Run, show: Callable[[Run], None]) -> AssembledFlight | None:
        """The flight to go on with; None if the run had to be ended, with its reason recorded. What passes, such as a
        disk that fails or a quarantine, is waited for: the vehicle may fly. `show` is given the run that tells, once,
        why it is not followed yet.
        """
        before, again_s, tries = as_before_unread(run), AGAIN_S, 0
        recorder = RunRecorder(before, self._parts.journal, self._parts.clock)
        while True:
            try:
                made = await self._find(before)
                if made is not None and before.state not in UNSTARTED and self._is_withdrawn(run.id):
                    await self._give_up(before, ReasonCode.ABORTED_UNREAD)
                    return None
                if made is not None and (recorder.run is not before or before is not run):
                    made.recorder.record(RunChanged(made.recorder.run))
                    await made.recorder.flush_within(self._parts.settings.stored_within_s)
                return made
            except (LinkError, StorageError, VehicleQuarantinedError) as error:
                log.warning("a run cannot be followed yet", run_id=run.id, error=error.detail)
                if recorder.run is before and not isinstance(error, StorageError):
                    told = unread(before, error.code, error.detail)
                    recorder.update(told, [RunChanged(told)])
                await recorder.flush_within(self._parts.settings.stored_within_s)
                if recorder.stored is not before:
                    show(recorder.stored)
                tries += isinstance(error, LinkError)
                if tries >= UNREAD_TRIES and isinstance(error, LinkError) and await self._has_ended(before):
                    return None
                await self._sleep(run.id, again_s)
                again_s = AGAIN_S if isinstance(error, StorageError) else min(2.0 * again_s, MOST_AGAIN_S)

    async def _find(self, run: Run) -> AssembledFlight | None:
        await self._fleet.until_may_follow(run.id, POLL_S)  # another gateway may have the site, or have had it
        if run.is_new_here and run.state in UNSTARTED:
            await self._give_up(run, ReasonCode.TAKEN_OVER_BEFORE_START)
            return None
        plan = await self._plan(run.plan_id)
        link = None if run.state in NOT_STARTED else await self._vehicle(run)
        if self._is_withdrawn(run.id):
            is_unstarted = run.state in UNSTARTED
            await self._give_up(run, ReasonCode.ABORTED_ON_GROUND if is_unstarted else ReasonCode.ABORTED_UNREAD)
            return None
        if plan is None or link is None:
            await self._give_up(run)
            return None
        carried = await self._carried(run, plan, link) if _is_same_vehicle(run, link) else None
        if carried is None:
            await self._give_up(run, ReasonCode.OTHER_MISSION_ON_BOARD)
            return None
        facts = partial(self._fleet.facts, run.vehicle_id)
        then = await facts()
        if run.state is RunState.STARTING and not link.state().armed:
            if await self._may_have_flown(run):
                await self._give_up(run, ReasonCode.RESTART_DURING_START_DISARMED)
                return None
            carried = replace(carried, run=await self._set_back(carried.run))
        state = await self._with_item_known(link) if run.is_new_here else link.state()
        carried = replace(carried, run=taken_over(carried.run, carried.mission, state))
        made = assemble(carried.run, carried.plan, carried.mission, link, then, facts, self._parts)
        if carried.run.taken_over != run.taken_over:
            made.recorder.record(RunChanged(carried.run))
        recovered = Recovered(
            made.monitor.observation(),
            in_flight=carried.run.state is not RunState.UPLOADED,
            flown=carried.run.flown_item_ids,
            current=link.state().mission_seq,
            arrived=carried.arrived,
        )
        made.monitor.feed(recovered)
        return made

    async def _has_ended(self, run: Run) -> bool:
        """Whether its vehicle has landed and disarmed, by which it is judged then though its mission was never read."""
        plan, clock = await self._plan(run.plan_id), self._parts.clock
        try:
            link, then = self._fleet.link(run.vehicle_id), await self._fleet.facts(run.vehicle_id)
        except (NotFoundError, VehicleQuarantinedError, LinkError):
            return False
        if plan is None or run.state not in IN_FLIGHT | {RunState.LANDED}:
            return False
        mission = compile_uploaded(run, plan, then)
        flight = begun_flight(run, plan, mission, then, self._parts.settings, clock.monotonic())
        ended = ended_unread(flight, Observation(link.state(), clock.monotonic(), clock.now()))
        if ended is not None:
            await self._end(run, ended)
        return ended is not None

    async def _sleep(self, run_id: str, seconds: float) -> None:
        """Or until it is withdrawn."""
        until_s = self._parts.clock.monotonic() + seconds
        while True:
            left_s = until_s - self._parts.clock.monotonic()
            if left_s <= 0.0 or self._is_withdrawn(run_id):
                return
            await asyncio.sleep(min(left_s, POLL_S))

    async def _may_have_flown(self, run: Run) -> bool:
        """Whether the start that was interrupted had commanded the mission, as far as this journal can tell: that is
        stored before it is sent.
        """
        if run.taken_over is not None:
            return True
        commanded, after = False, 0
        while events := await self._parts.journal.read(after, EVENTS_AT_ONCE, run.id):
            after = events[-1].seq
            for event in events:
                told = event.data
                if isinstance(told, RunCommand) and told.command is RunCommandName.START_MISSION:
                    commanded = True
                elif isinstance(told, RunChanged) and told.root.state is RunState.UPLOADED:
                    commanded = False  # an earlier start failed, and the vehicle was disarmed
        return commanded

    async def _set_back(self, run: Run) -> Run:
        """The run as before its start, which a person may repeat; stored."""
        now = self._parts.clock.now()
        reason = Reason.of(ReasonCode.RESTART_DURING_START_DISARMED)
        uploaded = run.moved_to(RunState.UPLOADED, now=now, reason=reason)
        recorder = RunRecorder(run, self._parts.journal, self._parts.clock)
        recorder.update(uploaded, [RunChanged(uploaded)])
        await recorder.flush()
        return uploaded

    async def _plan(self, plan_id: str) -> Plan | None:
        try:
            return await self._parts.plans.plan(plan_id)
        except NotFoundError:
            return None

    async def _vehicle(self, run: Run) -> VehicleLink | None:
        """Wait until the vehicle is connected, with its identity and mission known: for one that was not started as
        long as nobody ends its run, as without a restart.
        """
        deadline_s = self._parts.clock.monotonic() + self._parts.settings.lost_after_s
        while self._parts.clock.monotonic() < deadline_s or run.state in UNSTARTED:
            if self._is_withdrawn(run.id):
                return None
            try:
                link = self._fleet.link(run.vehicle_id)
            except NotFoundError:
                link = None
            except VehicleQuarantinedError:  # it is heard, though not alone
                link, deadline_s = None, self._parts.clock.monotonic() + self._parts.settings.lost_after_s
            if link is not None and _is_known(link):
                return link
            await asyncio.sleep(POLL_S)
        return None

    async def _with_item_known(self, link: VehicleLink) -> VehicleState:
        """The state with the item of a MISSION_CURRENT that came since: an older one may be of before the drop, and
        none comes with the HEARTBEAT of a vehicle that is heard again. If none comes, the item is unknown.
        """
        began_s = self._parts.clock.monotonic()
        while True:
            waited_s, state = self._parts.clock.monotonic() - began_s, link.state()
            if state.mission_age_s is not None and state.mission_age_s <= waited_s:
                return state
            if waited_s >= ITEM_KNOWN_S:
                return replace(state, mission_seq=None)
            await asyncio.sleep(POLL_S)

    async def _carried(self, run: Run, plan: Plan, link: VehicleLink) -> OnboardMission | None:
        """What the vehicle carries: the run's mission, or the one that was on its way to it; None if another.

        Its id suffices, as it does after an upload. The mission is read if the vehicle names none, or another one; and
        amid a change if it names the one of before, as it does for a moment after an upload.
        """
        facts, changed = await self._fleet.facts(run.vehicle_id), None
        if run.changing is not None and run.changing.mission_id != run.mission_id:
            changed = await self._plan(run.changing.plan_id)

        def found(items: Sequence[MissionItem] | None = None) -> OnboardMission | None:
            state = link.state()
            is_new = state.mission_age_s is not None and state.mission_age_s <= ITEM_KNOWN_S
            mission_id = state.mission_id if is_new or items is not None else None
            if mission_id is None and items is None:
                return None
            return carried_mission(run, plan, changed, facts, CarriedItems(mission_id, items, link.mission_id_of))

        named = found()
        if named is not None and (changed is None or named.arrived is not None):
            return named
        try:
            items = await link.download(MissionType.MISSION)
        except LinkError:
            if (named := found()) is None:
                raise
            return named
        return found(items)

    async def _give_up(self, run: Run, code: ReasonCode = ReasonCode.NOT_SEEN_AFTER_RESTART) -> None:
        """End a run that cannot be followed. What was commanded and not answered stays unknown."""
        if run.state in NOT_STARTED and code is ReasonCode.NOT_SEEN_AFTER_RESTART:
            code = ReasonCode.RESTART_BEFORE_UPLOAD_ENDED
        state = _ENDS.get(code, RunState.FAILED)
        await self._end(run, ended_unseen(run, state, Reason.of(code), self._parts.clock.now()))

    async def _end(self, run: Run, ended: Run) -> None:
        recorder = RunRecorder(run, self._parts.journal, self._parts.clock)
        if run.state not in UNSTARTED:
            with contextlib.suppress(NotFoundError, VehicleQuarantinedError):
                if _is_same_vehicle(run, link := self._fleet.link(run.vehicle_id)):
                    await leave_in_hold(link, recorder, partial(self._parts.may_command, run.id))
        recorder.update(ended, [RunChanged(ended)])
        await recorder.flush()


def _is_known(link: VehicleLink) -> bool:
    state = link.state()
    return state.connected and state.mode is not None and state.armed is not None and link.identity.uid is not None


def _is_same_vehicle(run: Run, link: VehicleLink) -> bool:
    return run.vehicle_uid is None or link.identity.uid == run.vehicle_uid
