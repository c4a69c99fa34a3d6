"""The lease of a gateway's site: renewed as long as the gateway runs, and recorded when another gateway takes it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Final

import structlog
from pydantic import ValidationError

from app.domain.cluster.errors import BusDownError, LeaseMovedError, NoReplyError
from app.domain.cluster.lease import RENEWED_EVERY_S, Leaseholder, LeaseState, SiteClaim, SiteUndecidedError
from app.domain.cluster.ports import Bus, Handover, LeftRun
from app.domain.errors import ConflictError, StorageError, WaydropError
from app.domain.events.service import SiteLeaseChanged
from app.domain.ports.journal import EventJournal
from app.services.background import begin_task, end_tasks
from app.services.clock import Clock
from app.services.handover import HandoverQueue

log = structlog.get_logger(__name__)

DECIDED_S: Final = 5.0
"""How long a gateway that starts waits to learn whether it has its site: another one may have taken its runs over. Then
it works alone until it is known, unless it has a standby."""
ANSWERED_S: Final = 2.0
"""Of one reading or writing of the lease. A lease that is renewed so late is still held."""
TAKEN_OVER_S: Final = 10.0


@dataclass(frozen=True)
class SiteTakeover:
    """What a person is told of a takeover. The runs left could not be taken over yet: each is tried again."""

    claim: SiteClaim
    left_run_ids: Sequence[str]


class SiteLease:
    """Takes the lease of the site, renews it, and takes it again as soon as it is free. It commands no vehicle.

    A lease of another gateway that has expired is taken only if a person says so, or if that gateway knows of its
    standby and is silent on the vehicles' links: it may fly on without NATS.
    """

    def __init__(
        self, site: str, me: Leaseholder, journal: EventJournal, bus: Bus, clock: Clock, handover: Handover
    ) -> None:
        self._site = site
        self._me = me
        self._journal = journal
        self._bus = bus
        self._clock = clock
        self._handover = handover
        self._left = HandoverQueue(handover)
        self._claim = SiteClaim()
        self._seen_held_s = clock.monotonic()
        self._told_to_take_over = False
        self._revision = 0
        self._replaced_by: str | None = None
        self._was_copied = False
        self._looked = asyncio.Condition()

    @property
    def claim(self) -> SiteClaim:
        """What is known of the lease now."""
        return self._claim.at(self._clock.monotonic())

    def why_no_new_work(self) -> WaydropError | None:
        """The gate of Fleet."""
        if self._left.is_untried:
            return SiteUndecidedError("runs of another gateway are being taken over", hint="wait a few seconds")
        return self.claim.why_no_new_work(self._site)

    def may_command(self) -> bool:
        """The second gate of Fleet: of two gateways that follow one run, only the holder commands by itself.

        For a copy of the holder's journal an expired lease does not change that: a person restarts it.
        """
        is_sure = self.claim.state in (LeaseState.HELD, LeaseState.ALONE)
        return is_sure and not self._was_copied

    def is_left(self, run_id: str) -> bool:
        """Whether another gateway followed this run, and how it went on is not known here yet."""
        return run_id in self._left.run_ids

    async def take_over(self) -> SiteTakeover:
        """A person says that the gateway whose lease has expired commands nothing any more: take its site and runs.

        Raises ConflictError: there is no such gateway, or it is back. NoReplyError: the site was not taken in time.
        """
        if self.claim.state is not LeaseState.EXPIRED:
            raise self._nothing_to_take_over()
        self._told_to_take_over = True
        try:
            async with asyncio.timeout(TAKEN_OVER_S):
                await self._until(self._is_taken_over_or_moved)
        except TimeoutError as error:
            if not self._is_held() or self._left.is_untried:
                raise NoReplyError("the site could not be taken yet", hint="see the log of this gateway") from error
        finally:
            self._told_to_take_over = False
        if not self._is_held():
            raise self._nothing_to_take_over()
        return SiteTakeover(self.claim, self._left.run_ids)

    def _is_taken_over_or_moved(self, claim: SiteClaim) -> bool:
        if claim.state is LeaseState.HELD:
            return not self._left.run_ids
        return claim.state is not LeaseState.EXPIRED

    def _nothing_to_take_over(self) -> ConflictError:
        return ConflictError(
            f"the lease of the site {self._site} is {self.claim.state.value}, not expired",
            hint="nothing can be taken over; a gateway that runs gives its site up when you stop it",
        )

    @asynccontextmanager
    async def kept(self) -> AsyncIterator[None]:
        """Keep the lease while the block runs. The block begins once it is decided who has it, or is not known soon."""
        tasks = (
            begin_task(self._keep(), "site lease"),
            begin_task(self._left.work(self._is_held), "handover of runs"),
        )
        try:
            with suppress(TimeoutError):
                async with asyncio.timeout(DECIDED_S):
                    await self._until(lambda claim: claim.state is not LeaseState.UNDECIDED)
            if self.claim.state is LeaseState.UNDECIDED and not self._me.has_standby:
                await self._know(self._unanswered(self._claim))
            yield
        finally:
            await end_tasks(*tasks)
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

    def _is_held(self) -> bool:
        return self.claim.state is LeaseState.HELD

    async def _keep(self) -> None:
        while True:
            await self._know(await self._look())
            await asyncio.sleep(RENEWED_EVERY_S)

    async def _look(self) -> SiteClaim:
        known = self.claim
        try:
            if known.state is LeaseState.HELD:
                return await self._renewed()
            return await self._taken_if_free(known)
        except LeaseMovedError:  # others write it, too, and the next look says who has it
            return SiteClaim() if known.holder is None else known
        except (BusDownError, TimeoutError, ValidationError, StorageError) as error:
            log.debug("the lease of the site is not known", error=str(error))
            return self._unanswered(known)

    def _unanswered(self, known: SiteClaim) -> SiteClaim:
        now_s = self._clock.monotonic()  # the process may have stood still while it asked
        claim = known.at(now_s).unanswered(now_s, has_standby=self._me.has_standby)
        # where a vehicle is not reached, the standby hears no HEARTBEAT, either, and may take over
        is_doubtful = self._me.has_standby and self._handover.has_lost_a_vehicle()
        return SiteClaim() if claim.state is LeaseState.ALONE and is_doubtful else claim

    async def _renewed(self) -> SiteClaim:
        """Raises BusDownError, TimeoutError, LeaseMovedError."""
        try:
            return await self._write(self._revision)
        except LeaseMovedError:
            return await self._taken_if_free(self.claim)

    async def _write(self, revision: int) -> SiteClaim:
        sent_s = self._clock.monotonic()
        async with asyncio.timeout(ANSWERED_S):
            self._revision = await self._bus.write_lease(self._site, self._message, after=revision)
        return SiteClaim.held(sent_s=sent_s)

    async def _taken_if_free(self, known: SiteClaim) -> SiteClaim:
        """Take the lease, unless another gateway has it, or had it (`known`) and may still command its vehicles.

        Raises BusDownError, TimeoutError, LeaseMovedError, StorageError.
        """
        before = known.holder
        async with asyncio.timeout(ANSWERED_S):
            found, revision = await self._bus.read_lease(self._site)
        holder = Leaseholder.model_validate_json(found) if found else None
        if holder is not None and not holder.is_same(self._me):
            self._seen_held_s = self._clock.monotonic()
            return SiteClaim.taken(holder)
        # free, or our own: of the process before this one, or written by a request whose answer was lost
        has_expired = holder is None and revision == 0
        left = await self._runs_left(is_needed=before is not None or (has_expired and self._me.has_standby))
        if before is None and has_expired:
            before = self._other_follower(left)
        if before is not None and has_expired and not self._may_take_over(before, left):
            return SiteClaim.expired(before)
        self._doubt(known, before, has_expired=has_expired)  # now: it stays if the answer to the writing is lost
        claim = await self._write(revision)
        self._doubt(known, before, has_expired=has_expired)
        if self._replaced_by is not None:
            await self._handover.reclaim(self._replaced_by, left)
        if self._replaced_by is not None or left:
            self._left.expect(left)
        self._replaced_by = None
        return claim

    def _doubt(self, known: SiteClaim, before: Leaseholder | None, *, has_expired: bool) -> None:
        """Note if another gateway may have followed the runs of this one."""
        was_unsure = known.at(self._clock.monotonic()).state is LeaseState.UNDECIDED
        if before is not None:
            self._replaced_by = before.gateway
        elif has_expired and self._me.has_standby and was_unsure and self._replaced_by is None:
            self._replaced_by = ""

    def _other_follower(self, left: Sequence[LeftRun]) -> Leaseholder | None:
        """A gateway that follows runs of this site, and of which nothing else is known."""
        others = (run.gateway for run in left if not run.is_over)
        return next((Leaseholder(gateway=gateway, address="") for gateway in others), None)

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

    def _may_take_over(self, before: Leaseholder, left: Sequence[LeftRun]) -> bool:
        held_age_s = self._clock.monotonic() - self._seen_held_s
        is_proven = before.has_standby and self._handover.is_silent(before, left, held_age_s)
        return self._told_to_take_over or is_proven

    @property
    def _message(self) -> bytes:
        return self._me.model_dump_json().encode()

    async def _know(self, claim: SiteClaim) -> None:
        before, self._claim = self._claim, claim
        self._was_copied = self._was_copied or claim.is_copied(self._me.gateway)
        async with self._looked:
            self._looked.notify_all()
        if (claim.holder, _has_expired(claim)) != (before.holder, _has_expired(before)):
            await self._record(claim)

    async def _record(self, claim: SiteClaim) -> None:
        holder = None if claim.holder is None else claim.holder.gateway
        if holder is None:
            log.info("this gateway has its site again", site=self._site)
        elif _has_expired(claim):
            hint = "if it is switched off, let this gateway take over: waydrop take-over"
            log.error("the gateway that had this site is not heard", site=self._site, holder=holder, hint=hint)
        else:
            log.error("another gateway has this site: nothing new may begin here", site=self._site, holder=holder)
        changed = SiteLeaseChanged(site=self._site, taken_by=holder, has_expired=_has_expired(claim))
        with suppress(StorageError):  # logged by the journal
            await self._journal.record(self._journal.new_event(changed))

    async def _give_up(self) -> None:
        """Let another gateway have the site at once."""
        was_held, self._claim = self._is_held(), SiteClaim()  # from now on nothing is commanded here
        if was_held:
            with suppress(BusDownError, LeaseMovedError):
                await self._bus.write_lease(self._site, b"", after=self._revision)


def _has_expired(claim: SiteClaim) -> bool:
    return claim.state is LeaseState.EXPIRED
