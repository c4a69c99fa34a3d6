"""From a created run to a vehicle that flies its mission: upload, then start."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import Final, Literal

from app.domain.autopilot import autopilot
from app.domain.errors import (
    CommandExpiredError,
    LinkError,
    LinkTimeoutError,
    PlanRejectedError,
    StorageError,
    VehicleRefusedError,
    VehicleTakenError,
    WaydropError,
)
from app.domain.events.run import (
    CommandOutcome,
    RunAck,
    RunCommand,
    RunCommandName,
    RunPlanRefused,
    RunUploadProgress,
    answer,
)
from app.domain.flight.inputs import UploadProgressed, UploadVerified
from app.domain.flight.modes import (
    armed_by_others,
    arming_obstacle,
    disarmed_by_others,
    disarmed_meanwhile,
    hold_hint,
    taken_meanwhile,
    takes_off_as_it_arms,
)
from app.domain.mission import NAN, MavCmd, Mission, MissionType
from app.domain.ports.vehicle_link import UploadProgress, VehicleLink
from app.domain.reasons import Reason, ReasonCode
from app.domain.rules import Finding
from app.domain.run.run import RunState
from app.domain.vehicle.commands import CommandRequest, MavResult
from app.domain.vehicle.facts import LinkFact, ParametersChanged
from app.domain.vehicle.state import FlightMode
from app.services.background import background
from app.services.clock import Clock
from app.services.runs.gates import refuse_fast_clock
from app.services.runs.monitor import FlightMonitor
from app.services.runs.recorder import RunRecorder
from app.services.runs.settings import RunSettings

GRAB: Final = 1.0
"""DO_GRIPPER param2: 1 is GRAB, 0 is RELEASE."""
_OF_A_START: Final = frozenset({FlightMode.HOLD, FlightMode.TAKEOFF, FlightMode.MISSION})
_ARMED_ALREADY: Final = "it is armed already, by an arming that was not acknowledged"
_TOLD: Final = 3
"""A change of one parameter may warn of every item."""
_STEP_PERCENT: Final = 2.0
_PROGRESS_S: Final = 0.05
"""A short upload has ended before, and is stored in one commit."""
_LISTS: Final[Mapping[MissionType, Literal["mission", "fence", "rally"]]] = {
    MissionType.MISSION: "mission",
    MissionType.FENCE: "fence",
    MissionType.RALLY: "rally",
}


class Preparation:
    """The steps before the flight, each recorded before and after. Cancelling a step ends its transfer.

    `check` returns the warnings that are new; it raises PlanRejectedError if the vehicle in its current state would not
    fly the uploaded plan. `closes_gripper`: the vehicle carries a parcel from the start, so its gripper must hold it
    before takeoff.
    """

    def __init__(
        self,
        link: VehicleLink,
        mission: Mission,
        recorder: RunRecorder,
        monitor: FlightMonitor,
        settings: RunSettings,
        clock: Clock,
        check: Callable[[], Awaitable[Sequence[Finding]]],
        *,
        closes_gripper: bool,
    ) -> None:
        self._link = link
        self._mission = mission
        self._recorder = recorder
        self._monitor = monitor
        self._settings = settings
        self._clock = clock
        self._check = check
        self._closes_gripper = closes_gripper
        self._progressed = asyncio.Event()
        self._changed, self._checked_s = False, 0.0
        self._arming_left = self._seen_armed = self._was_disarmed = False
        self.may_fly = False
        """A start armed the vehicle, or may have, and no disarming was accepted or seen since."""

    async def upload(self) -> None:
        """Upload and verify; the run is stored as uploading. Raises LinkError, StorageError."""
        verified: UploadProgress | None = None
        transfer = self._link.upload(self._mission)
        async with background(self._store_progress(), "progress of an upload"), contextlib.aclosing(transfer) as steps:
            async for step in steps:
                self._record_progress(step)
                verified = step if step.verified_by else verified
        if verified is None:
            raise LinkError("the upload ended without verification", hint="upload again")
        read_back = verified.verified_by == "read_back"
        reason = Reason.of(ReasonCode.UPLOAD_READ_BACK if read_back else ReasonCode.UPLOAD_VERIFIED)
        self._monitor.feed(UploadVerified(self._monitor.observation(), verified.mission_id, reason))
        await self._recorder.flush()

    async def start(self, at_first_item: Callable[[], None]) -> None:
        """Wait for readiness, secure the parcel, arm in Hold, start. If anything fails on the ground the vehicle is
        disarmed.

        `at_first_item` is called before arming: mission reports until then are not part of the flight.

        Raises:
            VehicleTakenError: somebody else armed it, changed its mode meanwhile, or disarmed it again.
            PlanRejectedError: its parameters changed, and it would not fly the plan; recorded with the findings.
            ConflictError: its clock is too fast for supervised drops. LinkError: with the vehicle's reason.
            StorageError.
        """
        if self._link.state().armed:
            raise armed_by_others("the vehicle", self._link.state().mode)
        self._seen_armed = self._was_disarmed = False
        self._monitor.reach(RunState.STARTING)
        await self._recorder.flush()
        unsubscribe = self._link.subscribe(self._on_fact)
        try:
            await self._start(at_first_item)
        finally:
            unsubscribe()

    async def _start(self, at_first_item: Callable[[], None]) -> None:
        await self._refuse_unfit()
        await refuse_fast_clock(self._link, self._mission, self._clock)
        await self._hold()
        await self._link.wait_mission_ready(
            mission_id=self._monitor.run.mission_id, rerun=False, timeout_s=self._settings.ready_s
        )
        self._refuse_others_lists()
        if self._closes_gripper:
            await self._close_gripper()
        await self._link.set_current(0)
        at_first_item()
        try:
            await self._arm()
            await self._start_mission()
        except (WaydropError, asyncio.CancelledError) as error:
            if self._was_disarmed or (isinstance(error, VehicleTakenError) and error.extra.get("armed") is False):
                self.may_fly = False
            if self.may_fly and self.is_not_taken and not isinstance(error, VehicleTakenError):
                await self._disarm()
            if takes_off_as_it_arms(self._link.state()):  # also if a pilot disarmed it
                with contextlib.suppress(WaydropError):
                    await self._hold()
            raise
        await self._record_outcome(RunCommandName.START_MISSION)

    @property
    def is_not_taken(self) -> bool:
        """Whether the vehicle is in a mode of its start, or of a failsafe. In any other, somebody else has it, and PX4
        would obey a disarming as long as it stands, a rover's also while it drives.
        """
        state = self._link.state()
        return state.mode in _OF_A_START or state.in_failsafe

    async def _refuse_changed(self) -> None:
        """Check again if a parameter changed or the last check is old."""
        if self._changed or self._clock.monotonic() - self._checked_s > self._settings.recheck_s:
            await self._refuse_unfit()

    def _on_fact(self, fact: LinkFact) -> None:
        self._changed = self._changed or isinstance(fact, ParametersChanged)
        if self.may_fly:
            armed = self._link.state().armed
            self._seen_armed = self._seen_armed or armed is True
            self._was_disarmed = self._was_disarmed or (self._seen_armed and armed is False)

    async def _refuse_unfit(self) -> None:
        self._changed, self._checked_s = False, self._clock.monotonic()
        try:
            new = await self._check()
        except PlanRejectedError as error:
            refused = RunPlanRefused(
                code=error.code,
                findings=error.extra["findings"],
                parameters_age_s=error.extra.get("parameters_age_s"),
            )
            self._recorder.record(refused)
            raise
        self._monitor.reach(RunState.STARTING, _told(new))

    def _record_progress(self, step: UploadProgress) -> None:
        percent = round(100.0 * step.sent / max(step.total, 1), 1)
        last = self._monitor.run.upload_percent
        done = step.sent >= step.total
        if last is not None and not done and 0 <= percent - last < _STEP_PERCENT:
            return
        progress = RunUploadProgress(
            mission_type=_LISTS[step.mission_type],
            sent=step.sent,
            total=step.total,
            attempt=step.attempt,
            percent=percent,
        )
        self._monitor.feed(UploadProgressed(self._monitor.observation(), progress))
        self._progressed.set()

    async def _store_progress(self) -> None:
        """Beside the transfer, which does not wait for the disk; the last progress is stored with what follows."""
        while True:
            await self._progressed.wait()
            await asyncio.sleep(_PROGRESS_S)
            self._progressed.clear()
            await self._recorder.flush_or_wait()

    async def _close_gripper(self) -> None:
        """PX4's gripper stays released after a flight: a later release would then be a no-op that is ACCEPTED."""
        request = CommandRequest(
            MavCmd.DO_GRIPPER,
            (NAN, GRAB, NAN, NAN, NAN, NAN, NAN),
            timeout_s=self._settings.ack_s,
            in_progress_timeout_s=self._settings.gripper_s,
        )
        await self._record_command(RunCommand(command=RunCommandName.DO_GRIPPER, params=(None, GRAB), action="grab"))
        final = None
        async for ack in self._link.command(request):
            self._recorder.record(answer(RunCommandName.DO_GRIPPER, ack))
            await self._recorder.flush()
            final = ack
        if final is None or final.result is not MavResult.ACCEPTED:
            word = final.word if final else "no answer"
            raise VehicleRefusedError(
                f"the gripper did not close before takeoff: {word}",
                hint=autopilot(self._link.identity.autopilot).gripper_hint,
            )

    async def _hold(self) -> None:
        """The previous flight may have left it in a mode in which PX4 does not arm, or takes off as it arms."""
        mode = self._link.state().mode
        if mode is FlightMode.HOLD:
            return
        await self._record_command(RunCommand(command=RunCommandName.HOLD, previous_mode=mode))
        try:
            await self._link.hold_disarmed()
        except VehicleTakenError as error:
            await self._record_outcome(RunCommandName.HOLD, error.detail)
            raise
        except LinkError as error:
            await self._record_outcome(RunCommandName.HOLD, error.detail)
            raise self._because_of_mode(error) from error
        await self._record_outcome(RunCommandName.HOLD)

    async def _arm(self) -> None:
        """Ask until it arms, and a HEARTBEAT after the answer reports it. Found armed after an arming that nobody
        answered, it is armed by that one. Disarmed since, it has been disarmed by somebody else, and stays so.
        """
        deadline_s = self._clock.monotonic() + self._settings.armable_s
        while True:
            await self._refuse_changed()
            self._refuse_taken()
            if self._link.state().armed:
                break
            error = await self._arm_once()
            if error is None:
                break
            if self._clock.monotonic() >= deadline_s:
                raise self._because_of_mode(error) from error
            await asyncio.sleep(self._settings.arm_again_s)
        try:
            await self._link.wait_armed()
            self._refuse_taken()
        except WaydropError as error:
            self.may_fly = self.may_fly and not isinstance(error, VehicleTakenError)
            await self._record_outcome(RunCommandName.ARM, error.detail)
            raise
        await self._record_outcome(RunCommandName.ARM)

    async def _arm_once(self) -> LinkError | None:
        """Command it; what kept it from arming, if it is worth another try. Raises VehicleTakenError, LinkError."""
        await self._record_command(RunCommand(command=RunCommandName.ARM))
        self._arming_left = False
        try:
            self._refuse_taken()
            await self._link.arm(self._arming_leaves)
        except WaydropError as error:
            if isinstance(error, VehicleTakenError):
                self.may_fly = self.may_fly and bool(error.extra.get("armed"))
            elif isinstance(error, VehicleRefusedError):
                self.may_fly = False
            is_ours = self.may_fly and isinstance(error, VehicleTakenError)
            await self._record_outcome(
                RunCommandName.ARM, _ARMED_ALREADY if is_ours else error.detail, is_sent=self._arming_left
            )
            if is_ours:
                return None
            if isinstance(error, VehicleRefusedError | LinkTimeoutError | CommandExpiredError):
                return error
            raise
        return None

    async def _start_mission(self) -> None:
        await self._record_command(RunCommand(command=RunCommandName.START_MISSION))
        is_sent = False
        try:
            if self._changed:
                await self._refuse_unfit()
            self._refuse_others_lists()
            self._refuse_taken()
            is_sent = True
            await self._link.start_mission()
        except WaydropError as error:
            with contextlib.suppress(StorageError):
                await self._record_outcome(RunCommandName.START_MISSION, error.detail, is_sent=is_sent)
            raise

    def _refuse_others_lists(self) -> None:
        """Another client may have replaced what was uploaded, even while the vehicle arms. Firmware that names the
        mission (MISSION_CURRENT) names fence and rally points too, and empty ones by 0. Raises VehicleRefusedError.
        """
        state, mission, wanted_id = self._link.state(), self._mission, self._monitor.run.mission_id
        if state.mission_id is None or wanted_id is None:
            return
        fence_id = self._link.fence_id_of(mission) if mission.fence else None
        rally_id = self._link.rally_points_id_of(mission) if mission.rally else None
        reported = ("mission", state.mission_id), ("geofence", state.fence_id), ("rally points", state.rally_points_id)
        names_as_we_do = wanted_id == self._link.mission_id_of(mission)
        for (name, on_board), wanted in zip(reported, (wanted_id, fence_id, rally_id), strict=True):
            if on_board != wanted and (names_as_we_do or name == "mission"):
                raise VehicleRefusedError(
                    f"the {name} on board changed since the upload: another client replaced or cleared what was there",
                    hint="abort the run and create it again",
                )

    def _arming_leaves(self) -> None:
        """It has just reported disarmed: from here on it is armed by this command, or by somebody else."""
        self.may_fly = self._arming_left = True

    def _refuse_taken(self) -> None:
        """It is in Hold, possibly by this command: whoever changes that controls it, and so does whoever disarms it.
        Raises VehicleTakenError.
        """
        state = self._link.state()
        self.may_fly = self.may_fly and not self._was_disarmed
        if state.armed and not self.may_fly:
            raise armed_by_others("the vehicle", state.mode)
        if self._was_disarmed:
            raise disarmed_meanwhile(state.mode)
        if state.mode is FlightMode.HOLD:
            return
        self.may_fly = False  # not ours any more, and so not ours to disarm
        if state.armed:  # by this start: whoever switched the mode took it
            raise taken_meanwhile(state.mode)
        raise disarmed_by_others(state.mode, hold_hint(self._monitor.run.vehicle_id))

    def _because_of_mode(self, error: LinkError) -> LinkError:
        """The same refusal with the mode as its cause, if it is one."""
        obstacle = arming_obstacle(self._link.state().mode)
        if not obstacle:
            return error
        return type(error)(f"{obstacle}: {error.detail}", hint=hold_hint(self._monitor.run.vehicle_id), **error.extra)

    async def _disarm(self) -> None:
        """PX4 refuses to disarm in flight, so this only acts on the ground. Sent to a disarmed vehicle too: the
        HEARTBEAT that reports armed may still be in transit.
        """
        with contextlib.suppress(StorageError):
            await self._record_command(RunCommand(command=RunCommandName.DISARM))
        try:
            await self._link.disarm()
            self.may_fly, problem = False, ""
        except WaydropError as error:
            problem = error.detail
        with contextlib.suppress(StorageError):
            await self._record_outcome(RunCommandName.DISARM, problem)

    async def _record_command(self, command: RunCommand) -> None:
        self._recorder.record(command)
        await self._recorder.flush()

    async def _record_outcome(self, command: RunCommandName, problem: str = "", *, is_sent: bool = True) -> None:
        outcome = CommandOutcome.DONE
        if problem:
            outcome = CommandOutcome.FAILED if is_sent else CommandOutcome.NOT_SENT
        self._recorder.record(RunAck(command=command, outcome=outcome, detail=problem))
        await self._recorder.flush()


def _told(warnings: Sequence[Finding]) -> Reason | None:
    if not warnings:
        return None
    messages = [f"{one.item_id}: {one.message}" if one.item_id else one.message for one in warnings[:_TOLD]]
    if more := len(warnings) - len(messages):
        messages.append(f"and {more} more")
    return Reason.of(ReasonCode.NEW_WARNINGS, detail="; ".join(messages))
