"""What rules need to know of a vehicle: version, home and parameters, read once and again after a reboot."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Final

from app.domain.default_facts import default_facts
from app.domain.errors import LinkTimeoutError
from app.domain.gripper_output import function_parameters
from app.domain.mav_type import vehicle_type
from app.domain.vehicle import VehicleFacts, VehicleType
from app.vehicles.decoders import AutopilotVersion, Heartbeat, HomePosition
from app.vehicles.gripper_output import limit_parameters
from app.vehicles.identity import Identity
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements
from app.vehicles.parameters import ParameterReader, Value

_ALSO: Final = ("COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_RC_IN_MODE", "COM_DL_LOSS_T", "COM_DISARM_PRFLT")
"""Read besides those that rules have a default for."""
_HEARD_WITHIN_S: Final = 3.0


class FactReader:
    """Reads and keeps the facts of one vehicle."""

    def __init__(
        self, measurements: Measurements, identity: Identity, parameters: ParameterReader, inbox: Inbox
    ) -> None:
        self._measurements = measurements
        self._identity = identity
        self._parameters = parameters
        self._turn = asyncio.Lock()
        self._heard = asyncio.Event()
        self._values: dict[str, Value] | None = None
        for kind in (Heartbeat, AutopilotVersion, HomePosition):
            inbox.on(kind, lambda _message, _at_s: self._heard.set())

    def forget(self) -> None:
        """Read the parameters again the next time."""
        self._values = None

    async def read(self) -> VehicleFacts:
        """See VehicleLink.read_facts.

        Raises:
            LinkTimeoutError: the type is not known, or no parameter at all came.
        """
        async with self._turn:
            kind = await self._type()
            if self._values is None:
                await self._until_complete()
                names = (*default_facts(kind).parameters, *_ALSO, *function_parameters())
                values = await self._parameters.read(names)
                if not values:
                    raise LinkTimeoutError("the vehicle answers no parameter request")
                self._values = values | await self._parameters.read(limit_parameters(values))
        return VehicleFacts(
            vehicle_type=kind,
            firmware=self._identity.firmware,
            uid=self._identity.uid,
            home=self._measurements.home,
            parameters=self._values,
            unanswered=frozenset(self._parameters.unanswered),
            least_clock_rate=self._measurements.clock.least_rate,
        )

    async def _type(self) -> VehicleType:
        beat = self._measurements.heartbeat or await self._first_heartbeat()
        kind = vehicle_type(beat.type)
        if kind is None:
            raise LinkTimeoutError(f"MAV_TYPE {beat.type} is no vehicle type that Waydrop can fly")
        return kind

    async def _first_heartbeat(self) -> Heartbeat:
        await self._wait(lambda: self._measurements.heartbeat is not None)
        if self._measurements.heartbeat is None:
            raise LinkTimeoutError("no HEARTBEAT yet: the vehicle's type is not known")
        return self._measurements.heartbeat

    async def _until_complete(self) -> None:
        """Version and home come by themselves; a vehicle without a fix has no home, so the wait is bounded."""
        await self._wait(lambda: self._identity.known and self._measurements.home is not None)

    async def _wait(self, condition: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + _HEARD_WITHIN_S
        while not condition():
            self._heard.clear()
            try:
                async with asyncio.timeout(deadline_s - time.monotonic()):
                    await self._heard.wait()
            except TimeoutError:
                return
