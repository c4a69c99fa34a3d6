"""What rules need to know of a vehicle: identity, version, home and parameters."""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Final

from app.domain.autopilot import Autopilot, autopilot
from app.domain.autopilot.base import GripperChannel
from app.domain.errors import LinkTimeoutError, WaydropError
from app.domain.mission import MavCmd
from app.domain.vehicle.state import FirmwareVersion, VehicleProfile, VehicleType, vehicle_type
from app.vehicles.command_sender import command
from app.vehicles.decoders import AutopilotVersion, Heartbeat, HomePosition
from app.vehicles.encoders import CommandLong, Outgoing
from app.vehicles.inbox import Inbox
from app.vehicles.measurements import Measurements
from app.vehicles.parameters import HASH_CHECK, KnownParameters, ParameterReader, Value
from app.vehicles.settings import LinkSettings

_AUTOPILOT_VERSION: Final = 148
_TWO_ANSWERS_S: Final = 5.0
"""Two different uids within so short a time are two vehicles; later it is another vehicle in the place of the first."""


class Identity:
    """Firmware and uid. Requests are sent without waiting: the acks of mavsdk's own requests look like ours."""

    def __init__(self, send: Callable[[Outgoing], None], settings: LinkSettings) -> None:
        self._send = send
        self._settings = settings
        self._asked_s: float | None = None
        self._heard_s: float | None = None
        self.firmware: FirmwareVersion | None = None
        self.uid: str | None = None
        self.known = False

    def ask(self, now_s: float) -> None:
        """Request AUTOPILOT_VERSION now."""
        self._asked_s = now_s
        request = command(MavCmd.REQUEST_MESSAGE, _AUTOPILOT_VERSION)
        self._send(CommandLong(int(request.command), request.params))

    def tick(self, now_s: float) -> None:
        """Ask again if it is time: often until the answer came, then now and then."""
        wait_s = self._settings.identity_recheck_s if self.known else self._settings.identity_retry_s
        if self._asked_s is None or now_s - self._asked_s >= wait_s:
            self.ask(now_s)

    def ask_soon(self, now_s: float) -> None:
        """Ask because of a suspicion, not more often than the retry time allows."""
        if self._asked_s is None or now_s - self._asked_s >= self._settings.identity_retry_s:
            self.ask(now_s)

    def forget_after_reboot(self) -> None:
        """Another firmware, or another vehicle, may answer next."""
        self._heard_s = self._asked_s = None
        self.known = False

    def take(self, message: AutopilotVersion, received_s: float) -> tuple[bool, str | None]:
        """An answer: whether something new is known, and the other uid if two vehicles answer."""
        uid, firmware = _uid(message), _firmware(message.flight_sw_version)
        recent = self._heard_s is not None and received_s - self._heard_s < _TWO_ANSWERS_S
        if recent and uid != self.uid and self.known:
            return False, uid or "none"
        news = not self.known or (uid, firmware) != (self.uid, self.firmware)
        self.uid, self.firmware, self.known, self._heard_s = uid, firmware, True, received_s
        return news, None


def _firmware(version: int) -> FirmwareVersion | None:
    if not version:
        return None
    return FirmwareVersion(version >> 24 & 0xFF, version >> 16 & 0xFF, version >> 8 & 0xFF)


def _uid(message: AutopilotVersion) -> str | None:
    if any(message.uid2):
        return bytes(message.uid2).hex()
    return f"{message.uid:016x}" if message.uid else None


# What rules need to know of a vehicle: version, home and parameters.
#
# The vehicle announces what is changed. What it does not announce is read again when it is old, and before a start;
# the checksum of all (`HASH_CHECK`) says whether an announcement was lost on the way.


_HEARD_WITHIN_S: Final = 3.0
_STALE_AFTER_S: Final = 30.0
_WAIT_S: Final = 1.0
_READINGS: Final = 3
"""A vehicle that restarts meanwhile is read anew, so often."""
_FRESH_WITHIN_S: Final = 8.0
"""A start waits longer than a check: parameters may be lost and asked for again, on a link that others use too."""


class FactReader:
    """Reads and keeps the facts of one vehicle. `changed` is called with parameters that are different now."""

    def __init__(
        self,
        measurements: Measurements,
        identity: Identity,
        parameters: ParameterReader,
        inbox: Inbox,
        changed: Callable[[Mapping[str, Value]], None],
    ) -> None:
        self._measurements = measurements
        self._identity = identity
        self._parameters = parameters
        self._known = KnownParameters(inbox, changed, self._read_unclear, parameters.unanswered)
        self._turn = asyncio.Lock()
        self._heard = asyncio.Event()
        self._checksum: Value | None = None
        self._limits: frozenset[str] = frozenset()
        self._boots = 0
        self._refreshing: asyncio.Task[None] | None = None
        self._refresh_began_s = -math.inf
        self._asking: asyncio.Task[None] | None = None
        self._unclear: dict[str, asyncio.Task[None]] = {}
        for kind in (Heartbeat, AutopilotVersion, HomePosition):
            inbox.on(kind, lambda _message, _at_s: self._heard.set())

    def gripper(self) -> GripperChannel | None:
        """The gripper's channel; None without one, or while the limits of its output are not read."""
        return self._autopilot.gripper_channel(self._known.values) if self.limits_read else None

    def has_gripper_output(self) -> bool | None:
        """Whether an output is assigned to the gripper; None: not known."""
        if not self._known.values:
            return None
        return self._autopilot.has_gripper_output(self._known.values, self._parameters.unanswered)

    @property
    def _autopilot(self) -> Autopilot:
        return autopilot(self._measurements.autopilot)

    @property
    def limits_read(self) -> bool:
        """Whether the vehicle was asked what the pulses of the gripper's output mean, since it has this output."""
        return self._limits.issuperset(self._autopilot.gripper_limits(self._known.values))

    def forget(self) -> None:
        """The vehicle restarted: read the parameters again the next time."""
        self._boots += 1
        self._stop()
        self._known.forget()
        self._limits = frozenset()

    def doubt(self) -> None:
        """Changes may have been missed: look at all of them the next time."""
        self._known.doubt()
        self._checksum = None

    async def close(self) -> None:
        """Read nothing more."""
        await asyncio.gather(*self._stop(), return_exceptions=True)

    async def read(self, *, fresh: bool = False) -> VehicleProfile:
        """See VehicleLink.read_facts.

        Raises:
            LinkTimeoutError: the type is not known, no parameter at all came, or `fresh` ones could not be read.
        """
        kind, began_s = await self._type(), time.monotonic()
        for _ in range(_READINGS):
            async with self._turn:
                while not self._known.values:
                    await self._read_all(kind)
            if fresh and not self._is_confirmed_since(began_s):
                await self._refreshed(kind, _FRESH_WITHIN_S, since_s=began_s)
                if self._asking is not None:  # what did not answer before may do so now
                    await asyncio.wait({self._asking}, timeout=_WAIT_S)
            elif not self.limits_read or self._known.age_s() > _STALE_AFTER_S:
                await self._refreshed(kind, _WAIT_S, since_s=-math.inf)
            if self._known.values:
                break
        else:
            raise LinkTimeoutError("the vehicle rebooted while its parameters were being read", hint="try again")
        if fresh and not self._is_confirmed_since(began_s):
            raise LinkTimeoutError(
                f"the vehicle's parameters could not be read again within {_FRESH_WITHIN_S:g} s",
                hint="the link may be poor or the vehicle busy: retry",
            )
        age_s = self._known.age_s()
        return VehicleProfile(
            vehicle_type=kind,
            firmware=self._identity.firmware,
            uid=self._identity.uid,
            home=self._measurements.home,
            parameters=self._known.values,
            unanswered=frozenset(self._parameters.unanswered),
            parameters_age_s=age_s if math.isfinite(age_s) else None,
            least_clock_rate=self._measurements.clock.least_rate,
            autopilot=self._measurements.autopilot,
        )

    async def _read_all(self, kind: VehicleType) -> None:
        boots = self._boots
        await self._until_complete()
        began_s = time.monotonic()
        values = await self._parameters.read((HASH_CHECK, *self._autopilot.defaults[kind], *self._autopilot.also_read))
        checksum = values.pop(HASH_CHECK, None)
        if not values:
            raise LinkTimeoutError("the vehicle does not answer parameter requests")
        limits = self._autopilot.gripper_limits(values)
        values |= await self._parameters.read(limits)
        if boots == self._boots:  # else it restarted meanwhile, and may have others
            self._known.put_read(values, began_s)
            self._known.confirm(began_s)
            self._checksum = checksum
            self._limits = frozenset(limits)

    def _is_confirmed_since(self, since_s: float) -> bool:
        return self._known.confirmed_s is not None and self._known.confirmed_s >= since_s

    async def _refreshed(self, kind: VehicleType, within_s: float, *, since_s: float) -> None:
        """Wait so long for one that began after `since_s`: what is under way, or the next. It goes on after that."""
        deadline_s = time.monotonic() + within_s
        while True:
            if self._refreshing is None or self._refreshing.done():
                self._refresh_began_s = time.monotonic()
                self._refreshing = asyncio.create_task(self._refresh(), name=f"parameters of a {kind}")
            began_s = self._refresh_began_s
            await asyncio.wait({self._refreshing}, timeout=max(0.0, deadline_s - time.monotonic()))
            if began_s >= since_s or time.monotonic() >= deadline_s:
                return

    async def _refresh(self) -> None:
        """Read what the vehicle does not announce; all that is known if announcements were missed."""
        began_s, known, boots = time.monotonic(), self._known, self._boots
        asked = known.unannounced
        with contextlib.suppress(WaydropError):  # the age of what is known says so
            found = await self._parameters.read((HASH_CHECK, *asked))
            checksum = found.pop(HASH_CHECK, None)
            if checksum is None or checksum != self._checksum:
                rest = known.values.keys() - found.keys()
                asked |= rest
                found |= await self._parameters.read(rest)
            if boots != self._boots:
                return
            known.put_read(found, began_s)
            if not self.limits_read:
                limits = self._autopilot.gripper_limits(known.values)
                known.put_read(await self._parameters.read(limits), began_s)
                self._limits = frozenset(limits)
            if found.keys() >= asked:
                known.confirm(began_s)
                self._checksum = checksum
            self._ask_silent()

    def _ask_silent(self) -> None:
        """Ask again for what never answered. Nobody waits: older firmware says nothing of a parameter that it lacks."""
        names = frozenset(self._parameters.unanswered) - self._known.values.keys() - {HASH_CHECK}
        if names and (self._asking is None or self._asking.done()):
            self._asking = asyncio.create_task(self._read_some(names), name="parameters without an answer")

    def _read_unclear(self, name: str) -> None:
        """A negative int was announced. One reading of a name is enough."""
        if self._parameters.is_reading(name) or name in self._unclear:
            return
        task = asyncio.create_task(self._read_some((name,)), name=f"parameter {name}")
        self._unclear[name] = task
        task.add_done_callback(lambda _: self._unclear.pop(name, None))

    async def _read_some(self, names: Collection[str]) -> None:
        began_s, boots = time.monotonic(), self._boots
        with contextlib.suppress(WaydropError):
            found = await self._parameters.read(names)
            if boots == self._boots:
                self._known.put_read(found, began_s)

    def _stop(self) -> Sequence[asyncio.Task[None]]:
        others = [task for task in (self._refreshing, self._asking) if task is not None]
        tasks = [*self._unclear.values(), *others]
        for task in tasks:
            task.cancel()
        return tasks

    async def _type(self) -> VehicleType:
        beat = self._measurements.heartbeat or await self._first_heartbeat()
        kind = vehicle_type(beat.type)
        if kind is None:
            raise LinkTimeoutError(f"MAV_TYPE {beat.type} is not a vehicle type that Waydrop supports")
        return kind

    async def _first_heartbeat(self) -> Heartbeat:
        await self._wait(lambda: self._measurements.heartbeat is not None)
        if self._measurements.heartbeat is None:
            raise LinkTimeoutError("no HEARTBEAT received yet: the vehicle type is unknown")
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
