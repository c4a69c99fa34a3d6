"""Idempotency-Key: a repeated request is executed once and gets the same response again."""

from __future__ import annotations

import asyncio
import hashlib
import json
import re
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, Final
from weakref import WeakValueDictionary

import structlog
from aiohttp import web

from app.api.bodies import JSON
from app.api.problems import ApiError
from app.domain.cluster.errors import NoReplyError
from app.domain.errors import StorageError, WaydropError
from app.domain.ports.stores import AnswerStore, ClaimStore, StoredAnswer
from app.services.access import Principal
from app.services.background import begin_task
from app.services.journal import STORED_WITHIN_S

HEADER: Final = "Idempotency-Key"
REPLAYED: Final = "Idempotency-Replayed"
_KEY: Final = re.compile(r"^[\x21-\x7e]{1,200}$")
_PLAIN_HEADS: Final = (json.dumps([JSON, []]), json.dumps(["", []]))
_KEPT_HEADERS: Final = ("Location", "ETag", "Content-Type")
log = structlog.get_logger(__name__)


class KeyedRequest:
    """A request with an Idempotency-Key that is being carried out."""

    def __init__(self, key: str, request_hash: str) -> None:
        self._key = key
        self._request_hash = request_hash
        self.is_claimed = False
        """Whether this request has the claim of its key: what another one claimed is not released."""
        self.committed: StoredAnswer | None = None
        """The answer that was to be stored in one commit with what the request creates."""

    def answer(self, response: web.StreamResponse) -> StoredAnswer | None:
        """What is kept of a response; None of one that is not replayed."""
        if not isinstance(response, web.Response) or response.status >= 300 or not isinstance(response.body, bytes):
            return None
        headers = {name: response.headers[name] for name in _KEPT_HEADERS if name in response.headers}
        return StoredAnswer(self._key, self._request_hash, response.status, headers, response.body)

    def commit(self, response: web.Response) -> StoredAnswer:
        """The answer to store in one commit with what the request creates: after a kill a repetition finds both."""
        answer = self.answer(response)
        if answer is None:
            raise TypeError("the response tells of nothing that was created")
        self.committed = answer
        return answer


class Idempotency:
    """Stores successful responses. Errors are not stored: nothing was created, so the client may retry.

    What a handler creates through `Call.answered` is stored in one commit with the response. That of a change which a
    vehicle may have got, although it did not say so, stays: the run tells what came of it.

    A key is scoped to one token and one path. A second request with the same key waits for the first. With `claims`,
    it is refused while the first is in progress on another node, or if the outcome of the first is unknown: also if
    that node died before it did anything, which nobody can tell from a call that is on its way. Urgent ones are carried
    out then, and if the disk does not answer: a pause that is sent twice does no harm, nor does a consent.
    """

    def __init__(self, store: AnswerStore, claims: ClaimStore | None = None) -> None:
        self._store = store
        self._claims = claims
        self._running: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()
        self._storing: set[asyncio.Task[None]] = set()

    async def answer(
        self,
        request: web.Request,
        principal: Principal,
        request_hash: str,
        make: Callable[[KeyedRequest | None], Awaitable[web.StreamResponse]],
        *,
        is_urgent: bool = False,
    ) -> web.StreamResponse:
        """Return the stored response of the key, or call `make` and store its response.

        Raises:
            ApiError: the key is invalid, was used with another request, or its first request has no known outcome.
            StorageError: the stored responses cannot be read, and the request is not urgent.
        """
        key = _key_of(request, principal)
        if key is None:
            return await make(None)
        lock = self._running.setdefault(key, asyncio.Lock())
        async with lock:
            keyed = KeyedRequest(key, request_hash)
            stored = await (self._begun_soon(key, keyed) if is_urgent else self._begun(key, keyed))
            if stored is not None:
                return _replay(stored, request_hash)
            try:
                response = await make(keyed)
            except (NoReplyError, StorageError):  # it may have been carried out: the claim stays
                raise
            except WaydropError as error:
                if not error.may_be_done:
                    undone = self._undo(key, keyed)
                    await (self._soon(undone, "key released") if is_urgent else undone)
                raise
            kept = self._keep(keyed, response)
            await (self._soon(kept, "response kept") if is_urgent else kept)
            return response

    async def _begun(self, key: str, keyed: KeyedRequest) -> StoredAnswer | None:
        """The stored answer. None: nobody has begun it. Raises ApiError: its outcome is unknown. StorageError."""
        stored = await self._store.get(key)
        if stored is not None:
            return stored
        keyed.is_claimed = await self._claimed(key)
        if keyed.is_claimed:
            return None
        stored = await self._store.get(key)  # the other node may have ended meanwhile
        if stored is None:
            raise ApiError(
                "idempotency.outcome_unknown",
                "a request with this Idempotency-Key is in progress on another node, or its outcome is unknown",
                hint="repeat it; if it is still unknown a minute after it was first sent, read what it was to create "
                "or change, and send it with a new key only if that was not done. This key is refused for a day",
            )
        return stored

    async def _begun_soon(self, key: str, keyed: KeyedRequest) -> StoredAnswer | None:
        """The stored answer. None: there is none, or it cannot be read within a moment."""
        try:
            async with asyncio.timeout(STORED_WITHIN_S):
                return await self._begun(key, keyed)
        except (TimeoutError, StorageError, ApiError):
            log.warning("Idempotency-Key not read: the command is sent")
            return None

    async def _soon(self, work: Coroutine[Any, Any, None], name: str) -> None:
        """If the disk takes longer than a moment, `work` goes on after the response."""
        task = begin_task(work, name)
        self._storing.add(task)
        task.add_done_callback(self._storing.discard)
        await asyncio.wait({task}, timeout=STORED_WITHIN_S)

    async def _claimed(self, key: str) -> bool:
        return self._claims is None or await self._claims.claim(key)

    async def _undo(self, key: str, keyed: KeyedRequest) -> None:
        """Nothing was done: the key may be used again."""
        if keyed.is_claimed:
            await self._release(key)
        if keyed.committed is not None:
            await self._forget(key)

    async def _release(self, key: str) -> None:
        if self._claims is None:
            return
        try:
            await self._claims.release(key)
        except StorageError as error:
            # the client gets the answer of the request; another one with this key is refused
            log.error("Idempotency-Key not released", error=error.detail)

    async def _forget(self, key: str) -> None:
        """It was announced with its answer, and refused then: it may be requested again."""
        try:
            await self._store.forget(key)
        except StorageError as error:
            log.error("response not deleted: a repeated request gets it", error=error.detail)

    async def _keep(self, keyed: KeyedRequest, response: web.StreamResponse) -> None:
        answer, committed = keyed.answer(response), keyed.committed
        if answer is None or answer == committed:
            return
        try:
            await self._store.put(answer, replaces=committed is not None)
        except StorageError as error:
            # the request succeeded: an error now would make the client send it again
            then = "is executed again" if committed is None else "gets the one stored with what it created"
            log.error(f"response not stored: a repeated request {then}", error=error.detail)


def request_hash(request: web.Request, raw: bytes) -> str:
    """The SHA-256 of what makes two requests with one key the same: query, content type and body.

    Of JSON without a query it is that of the body alone, as versions before this one have stored it.
    """
    head = json.dumps([request.content_type if raw else "", sorted(request.query.items())])
    return hashlib.sha256(raw if head in _PLAIN_HEADS else f"\0{head}\n".encode() + raw).hexdigest()


def _key_of(request: web.Request, principal: Principal) -> str | None:
    """What a response is stored by; None without a key. Raises ApiError."""
    given = request.headers.getall(HEADER, [])
    if not given:
        return None
    if len(given) > 1 or not _KEY.match(given[0]):
        raise ApiError(
            "idempotency.key_invalid",
            "Idempotency-Key must have 1 to 200 visible ASCII characters",
            hint="use a UUID",
        )
    scope = "\n".join((principal.token_id or principal.name, request.method, request.path, given[0]))
    return hashlib.sha256(scope.encode()).hexdigest()


def _replay(stored: StoredAnswer, request_hash: str) -> web.Response:
    if stored.request_hash != request_hash:
        raise ApiError(
            "idempotency.key_reused",
            "this Idempotency-Key was used with a different query, content type or body",
            hint="use a new key for a new request; repeat a request as it was",
        )
    return web.Response(body=stored.body, status=stored.status, headers={**stored.headers, REPLAYED: "true"})
