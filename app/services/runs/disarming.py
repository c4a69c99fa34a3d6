"""The last steps of a run: a vehicle that is left armed is disarmed, and one in Mission mode put in Hold."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from app.domain.errors import WaydropError
from app.domain.events.run import CommandOutcome, RunAck, RunCommand, RunCommandName
from app.domain.flight.modes import takes_off_as_it_arms
from app.domain.flight.step import awaits_disarming
from app.domain.ports.vehicle_link import VehicleLink
from app.services.background import end_tasks
from app.services.journal import STORED_WITHIN_S
from app.services.runs.monitor import FlightMonitor
from app.services.runs.recorder import RunRecorder


class EndDisarming:
    """Disarms it once, beside the observation of the flight, and stops as soon as somebody else has it: PX4 disarms a
    rover only after a return.
    """

    def __init__(
        self, link: VehicleLink, recorder: RunRecorder, monitor: FlightMonitor, may_command: Callable[[], bool]
    ) -> None:
        self._link = link
        self._recorder = recorder
        self._monitor = monitor
        self._may_command = may_command
        self._task: asyncio.Task[None] | None = None

    def look(self) -> None:
        """After each observation."""
        if self._task is None:
            if self._is_due:
                self._task = asyncio.create_task(self._disarm(), name="disarm at the end")
        elif self._link.state().armed and not self._is_due:
            self._task.cancel()

    async def close(self) -> None:
        """End it. Idempotent."""
        await end_tasks(self._task)

    async def hold(self) -> None:
        """After the flight. See leave_in_hold."""
        await leave_in_hold(self._link, self._recorder, self._may_command)

    @property
    def _is_due(self) -> bool:
        return self._may_command() and awaits_disarming(self._monitor.flight, self._monitor.observation())

    async def _disarm(self) -> None:
        self._recorder.record(RunCommand(command=RunCommandName.DISARM))
        try:
            await self._recorder.flush_or_wait()
            if not self._is_due:  # the disk was waited for
                self._answer(CommandOutcome.NOT_SENT, "somebody else has the vehicle")
                return
            await self._link.disarm()
        except asyncio.CancelledError:
            self._answer(CommandOutcome.UNKNOWN, "broken off")
            raise
        except WaydropError as error:
            self._answer(CommandOutcome.FAILED, error.detail)
        else:
            self._answer(CommandOutcome.DONE)

    def _answer(self, outcome: CommandOutcome, detail: str = "") -> None:
        """Stored with what follows; of a disarming that is broken off, as the run is let go."""
        self._recorder.record(RunAck(command=RunCommandName.DISARM, outcome=outcome, detail=detail))


async def leave_in_hold(link: VehicleLink, recorder: RunRecorder, may_command: Callable[[], bool]) -> None:
    """At the end of a run. PX4 leaves a vehicle in Mission mode, in which it takes off as soon as anybody arms it."""
    if not (may_command() and takes_off_as_it_arms(link.state())):
        return
    name, outcome, detail = RunCommandName.HOLD, CommandOutcome.DONE, ""
    recorder.record(RunCommand(command=name, previous_mode=link.state().mode))
    try:
        await recorder.flush_within(STORED_WITHIN_S)
        await link.hold_disarmed()
    except asyncio.CancelledError:
        recorder.record(RunAck(command=name, outcome=CommandOutcome.UNKNOWN, detail="broken off"))
        await recorder.flush_within(STORED_WITHIN_S)  # nothing follows: the run is over
        raise
    except WaydropError as error:
        outcome, detail = CommandOutcome.FAILED, error.detail
    recorder.record(RunAck(command=name, outcome=outcome, detail=detail))
