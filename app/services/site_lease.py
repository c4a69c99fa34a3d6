"""The lease of a gateway's site: renewed as long as the gateway runs, and recorded when another gateway takes it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from typing import Final

import structlog
from pydantic import ValidationError

from app.domain.cluster.errors import BusDownError, LeaseMovedError
from app.domain.cluster.lease import RENEWED_EVERY_S, Leaseholder, LeaseState, SiteClaim
from app.domain.cluster.ports import Bus, GatewaySite
from app.domain.errors import StorageError, WaydropError
from app.domain.events.service import SiteLeaseChanged
from app.domain.ports.journal import EventJournal
from app.services.clock import Clock

log = structlog.get_logger(__name__)

DECIDED_S: Final = 2.0
"""How long a gateway that starts waits to learn whether it has its site. Then it works alone until it is known."""


class SiteLease:
    """Takes the lease of the site, renews it, and takes it again as soon as it is free. It commands no vehicle."""

    def __init__(self, part: GatewaySite, journal: EventJournal, bus: Bus, clock: Clock) -> None:
        self._part = part
        self._me = Leaseholder(gateway=part.gateway, address=part.address)
        self._journal = journal
        self._bus = bus
        self._clock = clock
        self._claim = SiteClaim()
        self._revision = 0
        self._was_copied = False
        self._looked = asyncio.Condition()

    @property
    def claim(self) -> SiteClaim:
        """What is known of the lease now."""
        return self._claim.at(self._clock.monotonic())

    def why_no_new_work(self) -> WaydropError | None:
        """The gate of Fleet."""
        return self.claim.why_no_new_work(self._part.site)

    def may_command(self) -> bool:
        """The second gate of Fleet: of two gateways that follow one run, only the holder commands by itself.

        An expired lease does not change that, because the holder may fly on without NATS: a person restarts this one.
        """
        return not self._was_copied

    @asynccontextmanager
    async def kept(self) -> AsyncIterator[None]:
        """Keep the lease while the block runs. The block begins once it is decided who has it, or is not known soon."""
        task = asyncio.create_task(self._keep(), name="site lease")
        try:
            with suppress(TimeoutError):
                async with asyncio.timeout(DECIDED_S):
                    await self._until(lambda claim: claim.state in (LeaseState.HELD, LeaseState.TAKEN))
            if self.claim.state is LeaseState.UNDECIDED:
                await self._know(self._claim.unanswered())
            yield
        finally:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
            await self._give_up()

    async def while_allowed(
        self, allows: Callable[[SiteClaim], bool], part: Callable[[], AbstractAsyncContextManager[None]]
    ) -> None:
        """Run a part of the gateway whenever the claim allows it, until cancelled."""
        while True:
            await self._until(allows)
            async with part():
                await self._until(lambda claim: not allows(claim))

    async def _until(self, holds: Callable[[SiteClaim], bool]) -> None:
        async with self._looked:
            await self._looked.wait_for(lambda: holds(self.claim))

    async def _keep(self) -> None:
        while True:
            await self._know(await self._look())
            await asyncio.sleep(RENEWED_EVERY_S)

    async def _look(self) -> SiteClaim:
        sent_s = self._clock.monotonic()
        try:
            holder = await self._take()
        except LeaseMovedError:  # twice: others write it, too, and the next look says who has it
            return self.claim if self.claim.state is LeaseState.TAKEN else SiteClaim()
        except (BusDownError, ValidationError) as error:
            log.debug("the lease of the site is not known", error=str(error))
            return self.claim.unanswered()
        return SiteClaim.held(sent_s=sent_s) if holder is None else SiteClaim.taken(holder)

    async def _take(self) -> Leaseholder | None:
        """Write the lease. Who has it, if that is another gateway: its lease is never written over.

        Raises BusDownError, LeaseMovedError.
        """
        try:
            self._revision = await self._bus.write_lease(self._part.site, self._message, after=self._revision)
        except LeaseMovedError:
            self._revision = 0
            found, revision = await self._bus.read_lease(self._part.site)
            holder = Leaseholder.model_validate_json(found) if found else self._me
            if holder != self._me:
                return holder
            # free, or our own: of the process before this one, or written by a request whose answer was lost
            self._revision = await self._bus.write_lease(self._part.site, self._message, after=revision)
        return None

    @property
    def _message(self) -> bytes:
        return self._me.model_dump_json().encode()

    async def _know(self, claim: SiteClaim) -> None:
        before, self._claim = self._claim, claim
        self._was_copied = self._was_copied or claim.is_copied(self._part.gateway)
        async with self._looked:
            self._looked.notify_all()
        if claim.holder != before.holder:
            await self._record(claim)

    async def _record(self, claim: SiteClaim) -> None:
        holder = None if claim.holder is None else claim.holder.gateway
        if holder is None:
            log.info("this gateway has its site again", site=self._part.site)
        else:
            log.error("another gateway has this site: nothing new may begin here", site=self._part.site, holder=holder)
        changed = SiteLeaseChanged(site=self._part.site, taken_by=holder)
        with suppress(StorageError):  # logged by the journal
            await self._journal.record(self._journal.new_event(changed))

    async def _give_up(self) -> None:
        """Let another gateway have the site at once."""
        if self.claim.state is LeaseState.HELD:
            with suppress(BusDownError, LeaseMovedError):
                await self._bus.write_lease(self._part.site, b"", after=self._revision)
