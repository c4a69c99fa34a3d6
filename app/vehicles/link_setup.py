"""What a link does by itself when its vehicle appears, restarts or comes back: rates, facts, the gripper's channel."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from app.domain.errors import LinkError, LinkTimeoutError, VehicleQuarantinedError
from app.vehicles.fact_reader import FactReader
from app.vehicles.link_watch import LinkWatch
from app.vehicles.stream_rates import StreamRates

_AGAIN_AFTER_S: Final = 3.0
_log = logging.getLogger(__name__)


class LinkSetup:
    """Runs in the background until it succeeded; a new beginning replaces the one under way."""

    def __init__(self, rates: StreamRates, facts: FactReader, watch: LinkWatch) -> None:
        self._rates = rates
        self._facts = facts
        self._watch = watch
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Do it all (again)."""
        if self._task is not None:
            self._task.cancel()
        self._task = asyncio.create_task(self._until_done(), name="link setup")

    def begin_after_silence(self) -> None:
        """What the vehicle announced meanwhile was not heard."""
        self._facts.doubt()
        self.begin()

    def look_at_gripper(self) -> None:
        """Parameters changed: the gripper may have another output now, or none."""
        channel, before = self._facts.gripper(), self._watch.gripper
        is_over = self._task is None or self._task.done()
        self._watch.look_at(channel, self._facts.has_gripper_output())
        if channel != before or (is_over and not self._facts.limits_read):
            self.begin()  # the limits of another output are read, and its stream asked for

    def begin_after_reboot(self) -> None:
        """The vehicle may have another firmware and other parameters now."""
        self._facts.forget()
        self._watch.look_at(None, None)
        self.begin()

    async def close(self) -> None:
        """Stop."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _until_done(self) -> None:
        while True:
            try:
                await self._rates.set_all()
                await self._facts.read()
                if not self._facts.limits_read:
                    raise LinkTimeoutError("the limits of the gripper's output were not read yet")
                self._watch.look_at(self._facts.gripper(), self._facts.has_gripper_output())
                if self._watch.gripper is not None:
                    await self._rates.set_servo_outputs()
            except VehicleQuarantinedError:
                return
            except LinkError as error:
                _log.info("link setup did not end, trying again: %s", error.detail)
                await asyncio.sleep(_AGAIN_AFTER_S)
            else:
                return
