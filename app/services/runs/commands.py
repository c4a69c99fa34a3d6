"""Carries out what a flight commands: stored first, checked once more, then sent."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Coroutine, Sequence

import structlog

from app.domain.drop.supervised import still_waits
from app.domain.errors import CommandExpiredError, ConflictError, LinkError, StorageError, WaydropError
from app.domain.events.run import (
    CommandOutcome,
    HorizontalPosition,
    RunAck,
    RunCommand,
    RunCommandName,
    RunTargetMoved,
    answer,
)
from app.domain.flight.following import is_free
from app.domain.flight.inputs import (
    CommandFailed,
    ContingencyBegun,
    DivertBegun,
    FlightCommand,
    MoveWaypoint,
    ReleaseAcknowledged,
    ReleaseNotSent,
    ReleaseUnanswered,
    SetCurrentPending,
    TargetNotFollowed,
)
from app.domain.flight.snapshot import ContingencyCommand, DivertCommand, ReleaseCommand, ResumeCommand, is_order
from app.domain.flight.supervised_release import SupervisedRelease
from app.domain.mission import NAN
from app.domain.plan.intercept import FollowingDrop, follower_at, moved
from app.domain.ports.vehicle_link import VehicleLink
from app.domain.reasons import Reason
from app.domain.run.run import RunAction
from app.domain.vehicle.commands import CommandRequest
from app.domain.vehicle.state import FlightMode
from app.services.background import end_tasks
from app.services.plans import Plans
from app.services.runs.changing import ChangeRequest, MissionChanger
from app.services.runs.homing import HomeReturn
from app.services.runs.monitor import FlightMonitor
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RunSettings

log = structlog.get_logger(__name__)


class FlightCommandSender:
    """Carries out each command in a task of its own, and feeds the answers back to the flight."""

    def __init__(
        self,
        link: VehicleLink,
        recorder: RunRecorder,
        monitor: FlightMonitor,
        changer: MissionChanger,
        plans: Plans,
        settings: RunSettings,
        may_command: Callable[[], bool],
    ) -> None:
        self._may_command = may_command
        self._link = link
        self._recorder = recorder
        self._monitor = monitor
        self._changer = changer
        self._plans = plans
        self._settings = settings
        self._tasks: set[asyncio.Task[None]] = set()
        self.home_return = HomeReturn(
            link, recorder.record, lambda: monitor.run.home, lambda: monitor.flight.mode.has_returned
        )

    def carry_out(self, commands: Sequence[FlightCommand]) -> None:
        """Begin to send, unless another gateway follows the same run: then the other one commands."""
        segment = self._monitor.run.changes
        if commands and not self._may_command():
            log.error("another gateway has this journal: nothing is commanded here", run_id=self._monitor.run.id)
            self._spawn(self._leave(commands, segment), "leave to another gateway")
            return
        for command in commands:
            match command:
                case ReleaseCommand():
                    self._spawn(self._release(command, segment), f"release {command.plan_item_id} #{command.attempt}")
                case ResumeCommand():
                    self._spawn(self._resume_at(command, segment), f"resume at {command.seq}")
                case DivertCommand():
                    self._spawn(self._divert(command, segment), f"to the alternate of {command.plan_item_id}")
                case ContingencyCommand():
                    self._spawn(self._on_failure(command), f"{command.action} after {command.plan_item_id}")
                case MoveWaypoint():
                    self._spawn(self._move_waypoint(command), f"move {command.waypoint_id}")

    async def close(self) -> None:
        """End pending commands. A release that was sent stays recorded as commanded."""
        await end_tasks(*self._tasks)

    def _spawn(self, work: Coroutine[None, None, None], name: str) -> None:
        task = asyncio.create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _leave(self, commands: Sequence[FlightCommand], segment: int) -> None:
        """Whether the other gateway has sent a release is not known here, but its effect may be seen."""
        await asyncio.sleep(self._settings.ack_s)
        for command in commands:
            if isinstance(command, ReleaseCommand):
                about = (segment, command.plan_item_id, command.attempt)
                self._monitor.feed(ReleaseUnanswered(self._monitor.observation(), *about))

    # a failed drop ------------------------------------------------------------------------------------------------

    async def _on_failure(self, command: ContingencyCommand) -> None:
        """Carry out the contingency of a failed drop, unless a person was faster. If it fails, the mission goes on."""
        if is_order(self._monitor.run.commanded) and not await self._is_ordered_in_vain():
            return
        run = self._monitor.run
        self._changer.break_off()
        returns = command.action == "return"
        action = RunAction.CONTINGENCY if returns else RunAction.CONTINGENCY_HOLD
        name = RunCommandName.RETURN if returns else RunCommandName.HOLD
        self._monitor.feed(ContingencyBegun(self._monitor.observation(), action))
        self._recorder.record(RunCommand(command=name, failed_drop_id=command.plan_item_id))
        try:
            with self._monitor.commanding(action):
                await (self.home_return.order() if returns else self._link.hold())
            ack = RunAck(command=name, outcome=CommandOutcome.DONE)
        except WaydropError as error:
            ack = RunAck(command=name, outcome=CommandOutcome.FAILED, detail=error.detail)
            self._monitor.feed(CommandFailed(self._monitor.observation(), action, run.commanded, run.rally))
        self._recorder.record(ack)

    async def _is_ordered_in_vain(self) -> bool:
        """Wait until the vehicle obeys what it was told; False: it does, or it is not heard any more."""
        while is_order(self._monitor.run.commanded):
            state = self._link.state()
            if not state.connected or state.mode is not FlightMode.MISSION:
                return False
            await asyncio.sleep(self._settings.poll_every_s)
        return self._link.state().mode is FlightMode.MISSION

    # releases -----------------------------------------------------------------------------------------------------

    async def _release(self, command: ReleaseCommand, segment: int) -> None:
        drop = self._monitor.supervised(command.plan_item_id, segment)
        if drop is None:
            return
        params = tuple(None if math.isnan(p) else p for p in drop.compiled.params)
        self._recorder.record(RunCommand(command=_name_of(drop), params=params, attempt=command.attempt))
        try:
            await self._recorder.flush()
        except StorageError:
            self._withhold(command, segment, drop)
            return
        # storing may have taken time: the conditions must be true now
        now, snapshot = self._monitor.supervised(command.plan_item_id, segment), self._monitor.snapshot()
        if now is None or not now.machine.may_send(now.observation(snapshot)):
            self._withhold(command, segment, drop)
            return
        await self._send(command, segment, now, now.machine.send_before_s(now.observation(snapshot)))
        await self._recorder.flush_or_wait()

    async def _send(self, command: ReleaseCommand, segment: int, drop: SupervisedRelease, send_before_s: float) -> None:
        p1, p2, p3, p4, p5, p6, p7 = (*drop.compiled.params, *([NAN] * 7))[:7]
        request = CommandRequest(
            drop.compiled.command,
            (p1, p2, p3, p4, p5, p6, p7),
            timeout_s=self._settings.ack_s,
            attempts=1,
            in_progress_timeout_s=self._settings.gripper_s,
            send_before_s=send_before_s,
        )
        about = (segment, command.plan_item_id, command.attempt)
        try:
            async for ack in self._link.command(request):
                self._recorder.record(answer(_name_of(drop), ack, command.attempt))
                self._monitor.feed(ReleaseAcknowledged(self._monitor.observation(), *about, ack))
        except (CommandExpiredError, ConflictError):  # nothing was sent
            self._withhold(command, segment, drop)
        except LinkError as error:
            self._record_ack(command, drop, CommandOutcome.FAILED, detail=error.detail)
            self._monitor.feed(ReleaseUnanswered(self._monitor.observation(), *about))

    def _withhold(self, command: ReleaseCommand, segment: int, drop: SupervisedRelease) -> None:
        detail = "the conditions changed before it was recorded"
        self._record_ack(command, drop, CommandOutcome.NOT_SENT, detail=detail)
        about = (segment, command.plan_item_id, command.attempt)
        self._monitor.feed(ReleaseNotSent(self._monitor.observation(), *about))

    def _record_ack(
        self, command: ReleaseCommand, drop: SupervisedRelease, outcome: CommandOutcome, detail: str
    ) -> None:
        self._recorder.record(RunAck(command=_name_of(drop), outcome=outcome, attempt=command.attempt, detail=detail))

    # the mission's current item -----------------------------------------------------------------------------------

    async def _divert(self, command: DivertCommand, segment: int) -> None:
        """Send the vehicle to the alternate, once that is stored. If it fails, the bounded hold ends, and the drop at
        the alternate ends as one that was passed.
        """
        self._monitor.feed(DivertBegun(self._monitor.observation(), command.plan_item_id))
        try:
            await self._recorder.flush()
        except StorageError:
            return
        if self._still_waits(command.plan_item_id, segment):
            await self._set_current(command.seq, failed_drop_id=command.plan_item_id)

    async def _resume_at(self, command: ResumeCommand, segment: int) -> None:
        """Advance the mission after a drop. If it fails, the bounded hold ends."""
        if self._still_waits(command.plan_item_id, segment):
            await self._set_current(command.seq)

    def _still_waits(self, plan_item_id: str, segment: int) -> bool:
        """Whether the vehicle certainly waits at the drop until a command's last attempt: a later one would turn it
        back.
        """
        drop, snapshot = self._monitor.supervised(plan_item_id, segment), self._monitor.snapshot()
        return drop is not None and still_waits(drop.machine, drop.observation(snapshot), drop.machine.terms.resume_s)

    async def _set_current(self, seq: int, *, failed_drop_id: str | None = None) -> None:
        name = RunCommandName.SET_CURRENT
        self._recorder.record(RunCommand(command=name, params=(seq,), failed_drop_id=failed_drop_id))
        self._monitor.feed(SetCurrentPending(self._monitor.observation(), 1))
        try:
            await self._link.set_current(seq)
            ack = RunAck(command=name, outcome=CommandOutcome.DONE)
        except WaydropError as error:
            ack = RunAck(command=name, outcome=CommandOutcome.FAILED, detail=error.detail)
        finally:
            self._monitor.feed(SetCurrentPending(self._monitor.observation(), -1))
        self._recorder.record(ack)

    # a moving target ----------------------------------------------------------------------------------------------

    async def _move_waypoint(self, command: MoveWaypoint) -> None:
        """By a change of the mission, unless a person decides otherwise meanwhile: the next observation aims again."""
        run, plan = self._monitor.run, self._monitor.flight.segment.plan
        follower = follower_at(plan, run.item_id)
        if follower is None or follower.waypoint.id != command.waypoint_id:
            return
        try:
            changed, actor = moved(plan, follower, command.latitude_deg, command.longitude_deg), _actor(follower)
            new = await self._plans.checked(changed, actor)
            if self._monitor.run.changes != run.changes or not is_free(self._monitor.run):
                return
            wanted = ChangeRequest(new.stored.id, new.stored.hash, new.plan, new)
            await self._changer.change(wanted, None, actor, needed=(follower.waypoint.id, follower.drop.id))
        except WaydropError as error:
            reason = Reason.of_error(error.code, error.detail)
            self._monitor.feed(TargetNotFollowed(self._monitor.observation(), command.plan_item_id, reason))
            return
        self._recorder.record(self._target_moved(command, follower, new.stored.id))
        await self._recorder.flush_or_wait()

    def _target_moved(self, command: MoveWaypoint, follower: FollowingDrop, plan_id: str) -> RunTargetMoved:
        before, state = follower.waypoint, self._link.state()
        return RunTargetMoved(
            plan_item_id=command.plan_item_id,
            waypoint_id=command.waypoint_id,
            plan_id=plan_id,
            moved_from=HorizontalPosition(latitude_deg=before.latitude_deg, longitude_deg=before.longitude_deg),
            moved_to=HorizontalPosition(latitude_deg=command.latitude_deg, longitude_deg=command.longitude_deg),
            from_planned_m=command.moved_m,
            after_s=command.after_s,
            target=command.fix.evidence(state.latitude_deg, state.longitude_deg),
        )


def _actor(follower: FollowingDrop) -> str:
    return f"target {follower.target.feed}"


def _name_of(drop: SupervisedRelease) -> RunCommandName:
    return RunCommandName(drop.compiled.command.name)
