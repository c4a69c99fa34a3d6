"""The lease of a gateway's site: renewed as long as the gateway runs, and recorded when another gateway takes it."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from typing import Final

import structlog
from pydantic import ValidationError

from app.domain.cluster.errors import BusDownError, LeaseMovedError, NoReplyError
from app.domain.cluster.lease import RENEWED_EVERY_S, Leaseholder, LeaseState, SiteClaim, SiteUndecidedError
from app.domain.cluster.ports import Bus, GatewaySite, Handover, LeftRun
from app.domain.errors import ConflictError, StorageError, WaydropError
from app.domain.events.service import SiteLeaseChanged
from app.domain.ports.journal import EventJournal
from app.services.clock import Clock

log = structlog.get_logger(__name__)

DECIDED_S: Final = 5.0
"""How long a gateway that starts waits to learn whether it has its site: another one may have taken its runs over. Then
it works alone until it is known."""


TAKEN_OVER_S: Final = 10.0


class SiteLease:
    """Takes the lease of the site, renews it, and takes it again as soon as it is free. It commands no vehicle.

    A lease of another gateway that has expired is taken only if that gateway is silent on the links of all vehicles, or
    a person says so: it may fly on without NATS.
    """

    def __init__(
        self, part: GatewaySite, system_id: int, journal: EventJournal, bus: Bus, clock: Clock, handover: Handover
    ) -> None:
        """`system_id` is this gateway's own as a ground station."""
        self._part = part
        self._me = Leaseholder(gateway=part.gateway, address=part.address, system_id=system_id)
        self._journal = journal
        self._bus = bus
        self._clock = clock
        self._handover = handover
        self._claim = SiteClaim()
        self._told_to_take_over = False
        self._left: deque[LeftRun] = deque()
        self._revision = 0
        self._was_copied = False
        self._looked = asyncio.Condition()

    @property
    def claim(self) -> SiteClaim:
        """What is known of the lease now."""
        return self._claim.at(self._clock.monotonic())

    def why_no_new_work(self) -> WaydropError | None:
        """The gate of Fleet."""
        if self._left:
            return SiteUndecidedError(f"runs of another gateway are being taken over: {len(self._left)} are left")
        return self.claim.why_no_new_work(self._part.site)

    def may_command(self) -> bool:
        """The second gate of Fleet: of two gateways that follow one run, only the holder commands by itself.

        For a copy of the holder's journal an expired lease does not change that: a person restarts it.
        """
        is_sure = self.claim.state in (LeaseState.HELD, LeaseState.ALONE)  # not so after standing still
        return is_sure and not self._was_copied

    async def take_over(self) -> SiteClaim:
        """A person says that the gateway whose lease has expired commands nothing any more: take its site and runs.

        Raises ConflictError: there is no such gateway. NoReplyError: it could not be taken in time.
        """
        if self.claim.state is not LeaseState.EXPIRED:
            raise ConflictError(
                f"the lease of the site {self._part.site} is {self.claim.state.value}, not expired",
                hint="nothing can be taken over; a gateway that runs gives its site up when you stop it",
            )
        self._told_to_take_over = True
        try:
            async with asyncio.timeout(TAKEN_OVER_S):
                await self._until(lambda claim: claim.state is not LeaseState.EXPIRED and not self._left)
        except TimeoutError as error:
            raise NoReplyError("the site could not be taken yet", hint="see the log of this gateway") from error
        finally:
            self._told_to_take_over = False
        return self.claim

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
            await self._take_over_runs()
            await asyncio.sleep(RENEWED_EVERY_S)

    async def _look(self) -> SiteClaim:
        known = self.claim
        try:
            if known.state is LeaseState.HELD:
                return await self._renewed()
            return await self._taken_if_free(known.holder)
        except LeaseMovedError:  # others write it, too, and the next look says who has it
            return SiteClaim() if known.holder is None else known
        except (BusDownError, ValidationError) as error:
            log.debug("the lease of the site is not known", error=str(error))
            return known.unanswered()

    async def _renewed(self) -> SiteClaim:
        """Raises BusDownError, LeaseMovedError."""
        sent_s = self._clock.monotonic()
        try:
            self._revision = await self._bus.write_lease(self._part.site, self._message, after=self._revision)
        except LeaseMovedError:
            return await self._taken_if_free(None)
        return SiteClaim.held(sent_s=sent_s)

    async def _taken_if_free(self, before: Leaseholder | None) -> SiteClaim:
        """Take the lease, unless another gateway has it, or had it (`before`) and may still command its vehicles.

        Raises BusDownError, LeaseMovedError.
        """
        found, revision = await self._bus.read_lease(self._part.site)
        holder = Leaseholder.model_validate_json(found) if found else None
        if holder is not None and not holder.is_same(self._me):
            return SiteClaim.taken(holder)
        # free, or our own: of the process before this one, or written by a request whose answer was lost
        has_expired = holder is None and revision == 0
        if has_expired and before is not None and not self._may_take_over(before):
            return SiteClaim.expired(before)
        left = await self._runs_left(is_needed=before is not None)
        follower = next((run.gateway for run in left if not run.is_over), None)
        if has_expired and before is None and follower is not None and not self._told_to_take_over:
            return SiteClaim.expired(Leaseholder(gateway=follower, address=""))
        sent_s = self._clock.monotonic()
        self._revision = await self._bus.write_lease(self._part.site, self._message, after=revision)
        self._left = deque(left)
        return SiteClaim.held(sent_s=sent_s)

    async def _runs_left(self, *, is_needed: bool) -> Sequence[LeftRun]:
        """What the other gateway leaves, if another one had the site. Without API nodes a gateway works alone.

        Raises BusDownError: it is needed, and nobody says.
        """
        try:
            return await self._handover.runs_left()
        except BusDownError:
            raise
        except WaydropError as error:
            if not is_needed:
                return ()
            log.warning("the site cannot be taken: no API node says which runs are left", error=error.detail)
            raise BusDownError("no API node says which runs are left") from error

    async def _take_over_runs(self) -> None:
        """Go on with the runs that are left, as many as the lease leaves time for. What fails is tried again."""
        until_s = self._clock.monotonic() + RENEWED_EVERY_S
        while self._left and self._claim.state is LeaseState.HELD and self._clock.monotonic() < until_s:
            try:
                await self._handover.take_over(self._left[0])
            except WaydropError as error:
                log.error("a run cannot be taken over yet", run_id=self._left[0].run_id, error=error.detail)
                return
            self._left.popleft()

    def _may_take_over(self, before: Leaseholder) -> bool:
        return self._told_to_take_over or self._handover.is_silent(before)

    @property
    def _message(self) -> bytes:
        return self._me.model_dump_json().encode()

    async def _know(self, claim: SiteClaim) -> None:
        before, self._claim = self._claim, claim
        self._was_copied = self._was_copied or claim.is_copied(self._part.gateway)
        async with self._looked:
            self._looked.notify_all()
        if (claim.holder, _has_expired(claim)) != (before.holder, _has_expired(before)):
            await self._record(claim)

    async def _record(self, claim: SiteClaim) -> None:
        holder = None if claim.holder is None else claim.holder.gateway
        if holder is None:
            log.info("this gateway has its site again", site=self._part.site)
        elif _has_expired(claim):
            hint = "if it is switched off, let this gateway take over: waydrop take-over"
            log.error("the gateway that had this site is not heard", site=self._part.site, holder=holder, hint=hint)
        else:
            log.error("another gateway has this site: nothing new may begin here", site=self._part.site, holder=holder)
        changed = SiteLeaseChanged(site=self._part.site, taken_by=holder, has_expired=_has_expired(claim))
        with suppress(StorageError):  # logged by the journal
            await self._journal.record(self._journal.new_event(changed))

    async def _give_up(self) -> None:
        """Let another gateway have the site at once."""
        if self.claim.state is LeaseState.HELD:
            with suppress(BusDownError, LeaseMovedError):
                await self._bus.write_lease(self._part.site, b"", after=self._revision)


def _has_expired(claim: SiteClaim) -> bool:
    return claim.state is LeaseState.EXPIRED
