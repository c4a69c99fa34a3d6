"""What a link does by itself when its vehicle appears, restarts or comes back: rates, facts, the gripper's channel."""

from __future__ import annotations

import asyncio
import logging
from typing import Final

from app.domain.errors import LinkError, VehicleQuarantinedError
from app.domain.gripper_output import has_gripper_output
from app.vehicles.fact_reader import FactReader
from app.vehicles.gripper_output import gripper_channel
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

    def begin_after_reboot(self) -> None:
        """The vehicle may have another firmware and other parameters now."""
        self._facts.forget()
        self._watch.gripper = None
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
                facts = await self._facts.read()
                self._watch.gripper = gripper_channel(facts.parameters)
                self._watch.has_gripper_output(has_gripper_output(facts))
                if self._watch.gripper is not None:
                    await self._rates.set_servo_outputs()
            except VehicleQuarantinedError:
                return
            except LinkError as error:
                _log.info("link setup did not end, trying again: %s", error.detail)
                await asyncio.sleep(_AGAIN_AFTER_S)
            else:
                return
