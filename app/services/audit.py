"""The audit: accepted requests from the journal, rejected ones from a store of their own, tokens from theirs."""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Final

import structlog

from app.domain.audit import AuditEntry, AuditFilter, AuditOutcome, RefusalStore, RejectedRequests
from app.domain.errors import InvalidInputError, StorageError
from app.domain.events import Event
from app.domain.events.service import RequestAccepted
from app.domain.ports.journal import AuditedJournal
from app.domain.ports.stores import StoredToken, TokenStore
from app.services.access import Principal
from app.services.background import background
from app.services.clock import Clock

log = structlog.get_logger(__name__)

WRITTEN_EVERY_S: Final = 1.0
MOST_WAITING: Final = 256
"""Different refusals, and accepted frames, that may wait to be written; further ones are counted and logged."""

PAGE: Final = 200
"""Rows that are read of each source at once."""


class Audit:
    """`recording` writes what `accept_soon` and `refuse` receive; reading works without it."""

    def __init__(self, journal: AuditedJournal, refusals: RefusalStore, tokens: TokenStore, clock: Clock) -> None:
        self._journal = journal
        self._refusals = refusals
        self._tokens = tokens
        self._clock = clock
        self._refused: dict[tuple[str, ...], RejectedRequests] = {}
        self._accepted: list[RequestAccepted] = []
        self._lost = 0
        self._waiting = asyncio.Event()

    async def accept(self, principal: Principal, action: str, target: str) -> None:
        """Record a request that was carried out; it is on the disk when this returns, or logged."""
        await self._record([_accepted(principal, action, target)])

    def accept_soon(self, principal: Principal, action: str, target: str) -> None:
        """Record without waiting: frames behind this one may be setpoints."""
        if len(self._accepted) < MOST_WAITING:
            self._accepted.append(_accepted(principal, action, target))
        else:
            self._lost += 1
        self._waiting.set()

    def refuse(
        self, principal: Principal | None, address: str, action: str, target: str, status: int, code: str
    ) -> None:
        """Record a rejected request. Requests that are alike within a second are one line with their number."""
        actor, token_id = ("", "") if principal is None else (principal.name, principal.token_id)
        # of strangers the target does not count: they could choose a new one each time
        key = (actor, token_id, address, code, *((action, target) if actor else ()))
        known = self._refused.get(key)
        if known is not None:
            self._refused[key] = replace(known, count=known.count + 1)
        elif len(self._refused) < MOST_WAITING:
            now = self._clock.now()
            self._refused[key] = RejectedRequests(now, actor, token_id, address, action, target, status, code)
        else:
            self._lost += 1
        self._waiting.set()

    @contextlib.asynccontextmanager
    async def recording(self) -> AsyncIterator[None]:
        """Write while the block runs; what waits at its end is written too."""
        try:
            async with background(self._write(), "audit"):
                yield
        finally:
            await self._flush()

    @property
    def waiting(self) -> int:
        """How many lines wait to be written."""
        return len(self._refused) + len(self._accepted)

    async def page(self, wanted: AuditFilter, *, limit: int, cursor: str | None) -> tuple[list[AuditEntry], str | None]:
        """Entries, newest first, and the cursor of the next page; None behind the last one.

        Raises:
            InvalidInputError: the cursor is not one that was returned.
            StorageError: they cannot be read.
        """
        place = _Place.read(cursor)
        sources = (
            _Source(self._journal_entries, place.seq),
            _Source(self._refusal_entries, place.position),
            _Source(self._token_entries, place.token),
        )
        found: list[AuditEntry] = []
        while len(found) < limit:
            heads = [(await source.head(), source) for source in sources]
            ready = [(entry, source) for entry, source in heads if entry is not None]
            if not ready:
                return found, None
            entry, source = max(ready, key=lambda one: one[0].time)
            source.take()
            if wanted.wants(entry):
                found.append(entry)
        return found, _Place(*(source.place for source in sources)).written()

    async def _write(self) -> None:
        while True:
            await self._waiting.wait()
            await self._flush()
            await asyncio.sleep(WRITTEN_EVERY_S)

    async def _flush(self) -> None:
        self._waiting.clear()
        accepted, self._accepted = self._accepted, []
        refused, self._refused = tuple(self._refused.values()), {}
        lost, self._lost = self._lost, 0
        if accepted:
            await self._record(accepted)
        try:
            await self._refusals.add(refused)
        except StorageError as error:
            lost, reason = lost + len(refused), error.detail
        else:
            reason = "too many at once"
        if lost:
            log.error("not recorded for the audit", count=lost, reason=reason)

    async def _record(self, accepted: Sequence[RequestAccepted]) -> None:
        try:
            await self._journal.record(*(self._journal.new_event(one) for one in accepted))
        except StorageError as error:
            log.error("not recorded for the audit", accepted=[one.action for one in accepted], reason=error.detail)

    async def _journal_entries(self, before: int | None) -> list[tuple[int, AuditEntry]]:
        return [(event.position, _entry_of(event)) for event in await self._journal.newest_accepted(before, PAGE)]

    async def _refusal_entries(self, before: int | None) -> list[tuple[int, AuditEntry]]:
        found = await self._refusals.newest(before=before, limit=PAGE)
        return [(position, _refused_entry(refusal)) for position, refusal in found]

    async def _token_entries(self, before: int | None) -> list[tuple[int, AuditEntry]]:
        """Numbered from the oldest: newer ones do not change the number."""
        entries = sorted(_of_tokens(await self._tokens.list_tokens()), key=lambda entry: entry.time)
        numbered = [(number, entry) for number, entry in enumerate(entries, 1) if before is None or number < before]
        return numbered[::-1]


Reader = Callable[[int | None], Awaitable[list[tuple[int, AuditEntry]]]]
"""Reads a page of entries before a number, newest first, each with its number."""


class _Source:
    """One source, read page by page, newest first. `place` is that of the last entry that was taken."""

    def __init__(
        self, read: Callable[[int | None], Awaitable[list[tuple[int, AuditEntry]]]], place: int | None
    ) -> None:
        self.place = place
        self._read = read
        self._page: list[tuple[int, AuditEntry]] = []
        self._is_over = False

    async def head(self) -> AuditEntry | None:
        """The next entry; None behind the last one."""
        if not self._page and not self._is_over:
            self._page = (await self._read(self.place))[::-1]
            self._is_over = not self._page
        return self._page[-1][1] if self._page else None

    def take(self) -> None:
        """Continue after it."""
        self.place = self._page.pop()[0]


_NUMBER: Final = re.compile(r"[0-9]{1,18}")
"""What a column of 64 bits can hold."""


@dataclass(frozen=True, slots=True)
class _Place:
    seq: int | None = None
    position: int | None = None
    token: int | None = None

    def written(self) -> str:
        return ".".join("" if part is None else str(part) for part in (self.seq, self.position, self.token))

    @classmethod
    def read(cls, cursor: str | None) -> _Place:
        parts = ["", "", ""] if cursor is None else cursor.split(".")
        if len(parts) != 3 or not all(part == "" or _NUMBER.fullmatch(part) for part in parts):
            raise InvalidInputError("this is not a cursor of the audit log", hint="use `next` of the previous page")
        return cls(*(None if part == "" else int(part) for part in parts))


def _accepted(principal: Principal, action: str, target: str) -> RequestAccepted:
    return RequestAccepted(actor=principal.name, token_id=principal.token_id, action=action, target=target)


def _entry_of(event: Event) -> AuditEntry:
    data = event.data
    if not isinstance(data, RequestAccepted):
        raise AssertionError(f"event {event.seq} is of another kind")
    return _accepted_entry(event.time, data, event.seq)


def _accepted_entry(time: float, accepted: RequestAccepted, seq: int | None) -> AuditEntry:
    outcome = AuditOutcome.ACCEPTED
    return AuditEntry(
        **dict(accepted), time=time, outcome=outcome, address=None, status=None, code=None, count=1, seq=seq
    )


def _refused_entry(refusal: RejectedRequests) -> AuditEntry:
    return AuditEntry(**asdict(refusal), outcome=refusal.outcome, seq=None)


def _of_tokens(tokens: Sequence[StoredToken]) -> list[AuditEntry]:
    """Tokens are created and revoked on the command line of the machine, so the actor is unknown."""
    changes = [(token, "create_token", token.created_at) for token in tokens]
    changes += [(token, "revoke_token", at) for token in tokens if (at := token.revoked_at) is not None]
    return [
        _accepted_entry(
            at,
            RequestAccepted(
                actor="command line",
                token_id="",
                action=action,
                target=f"{token.name} ({token.id}, {token.role})",
            ),
            seq=None,
        )
        for token, action, at in changes
    ]
