"""The vehicle links as their guards see them: what is refused is logged and recorded, and vehicles get their keys."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

import structlog
from pydantic import BaseModel, ConfigDict

from app.domain.errors import ConflictError, StorageError, WaydropError
from app.domain.events.service import LinkRefused
from app.domain.events.vehicle import VehicleLinkKey
from app.domain.ports.vehicle_link import LinkGuards
from app.domain.reasons import Reason
from app.domain.vehicle.link_security import NOT_RECORDED, LinkSecurity, RefusalKind, Refused, Relayed
from app.services.background import begin_task, end_tasks
from app.services.fleet import Fleet
from app.services.journal import Journal

log = structlog.get_logger(__name__)
POLL_S: Final = 1.0
RECORD_EVERY_S: Final = 60.0
"""One event, and one line in the log, for each reason in this time."""
MOST_SYSTEMS: Final = 8


class LinkKeySetUp(BaseModel):
    """A vehicle signs with a new key now."""

    model_config = ConfigDict(frozen=True, title="LinkKeySetUp")

    vehicle_id: str
    fingerprint: str
    link_security: LinkSecurity


@dataclass(slots=True)
class _Unrecorded:
    """Rejected frames with one reason since the last record."""

    recorded_s: float = -RECORD_EVERY_S
    count: int = 0
    connections: dict[str, None] = field(default_factory=dict)
    systems: dict[int, None] = field(default_factory=dict)
    peer: str = ""


class RefusalLog:
    """Turns growing counts into events, a bounded number in any time. Pure but for its clock."""

    def __init__(self, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._monotonic = monotonic
        self._known: dict[tuple[str, RefusalKind], int] = {}
        self._unrecorded: dict[RefusalKind, _Unrecorded] = {}

    def take(self, refused: Sequence[Refused]) -> list[LinkRefused]:
        """Take the current counts; return what to record."""
        for one in refused:
            key = (one.connection, one.kind)
            more = one.count - self._known.get(key, 0)
            self._known[key] = one.count
            if more <= 0 or one.kind in NOT_RECORDED:
                continue
            unrecorded = self._unrecorded.setdefault(one.kind, _Unrecorded())
            unrecorded.count += more
            unrecorded.peer = one.peer
            unrecorded.connections[one.connection] = None
            unrecorded.systems.update(dict.fromkeys(one.systems))
        now_s = self._monotonic()
        due = [kind for kind, one in self._unrecorded.items() if one.count and now_s - one.recorded_s >= RECORD_EVERY_S]
        return [self._to_record(kind, now_s) for kind in due]

    def _to_record(self, kind: RefusalKind, now_s: float) -> LinkRefused:
        unrecorded = self._unrecorded[kind]
        self._unrecorded[kind] = _Unrecorded(recorded_s=now_s)
        return LinkRefused(
            refusal=kind,
            count=unrecorded.count,
            connections=tuple(unrecorded.connections),
            peer=unrecorded.peer,
            systems=tuple(unrecorded.systems)[:MOST_SYSTEMS],
        )


class VehicleLinks:
    """`start`, then polls once a second until `close`."""

    def __init__(self, guards: LinkGuards, fleet: Fleet, journal: Journal) -> None:
        self._guards = guards
        self._fleet = fleet
        self._journal = journal
        self._refusals = RefusalLog()
        self._polling: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Start polling rejected frames."""
        self._polling = begin_task(self._poll(), "link refusals")

    async def close(self) -> None:
        """Stop polling. Idempotent."""
        await end_tasks(self._polling)

    def refused(self) -> Sequence[Refused]:
        """Frames rejected since the start, by connection and reason."""
        return self._guards.refused()

    def relayed(self) -> Sequence[Relayed]:
        """What passed since the start, by connection."""
        return self._guards.relayed()

    async def set_up_signing(self, vehicle_id: str, actor: str) -> LinkKeySetUp:
        """Send a vehicle its newest key over its link, which the caller trusts: anybody who reads the link can control
        the vehicle.

        Raises:
            NotFoundError: no such vehicle, or it has no key. ConflictError: it is armed, has a run, or already uses its
            newest key, or its connection is open. VehicleQuarantinedError: somebody else may speak for it.
            LinkTimeoutError: it continues as before. StorageError: nothing was sent.
        """
        vehicle = self._fleet.vehicle(vehicle_id)
        self._fleet.require_usable(vehicle_id)
        if vehicle.run_id is not None or vehicle.link.state().armed:
            raise ConflictError(
                f"vehicle {vehicle_id} {'is armed' if vehicle.run_id is None else f'has run {vehicle.run_id}'}",
                hint="a vehicle accepts a key only while disarmed; end its run first",
            )
        await self._record(vehicle_id, actor, "sent")
        try:
            identity = vehicle.link.identity
            fingerprint = await self._guards.set_up_signing(identity.system_id, identity.connection)
        except WaydropError as error:
            with contextlib.suppress(StorageError):
                await self._record(vehicle_id, actor, "failed", reason=Reason.of_error(error.code, error.detail))
            raise
        await self._record(vehicle_id, actor, "done", fingerprint)
        return LinkKeySetUp(vehicle_id=vehicle_id, fingerprint=fingerprint, link_security=LinkSecurity.SIGNED)

    async def _record(
        self,
        vehicle_id: str,
        actor: str,
        outcome: Literal["sent", "done", "failed"],
        fingerprint: str | None = None,
        reason: Reason | None = None,
    ) -> None:
        payload = VehicleLinkKey(actor=actor, outcome=outcome, fingerprint=fingerprint, reason=reason)
        await self._journal.record(self._journal.new_event(payload, vehicle_id=vehicle_id))

    async def _poll(self) -> None:
        while True:
            for refused in self._refusals.take(self._guards.refused()):
                log.warning(
                    "frames were rejected on a vehicle link",
                    refusal=refused.refusal.value,
                    count=refused.count,
                    connections=list(refused.connections),
                    peer=refused.peer,
                    systems=list(refused.systems),
                )
                with contextlib.suppress(StorageError):  # logged by the journal
                    await self._journal.record(self._journal.new_event(refused))
            await asyncio.sleep(POLL_S)
