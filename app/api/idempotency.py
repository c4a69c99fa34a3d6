"""Idempotency-Key: the same request sent twice is done once, and answered twice with the same answer."""

from __future__ import annotations

import asyncio
import hashlib
import re
from collections.abc import Awaitable, Callable
from typing import Final
from weakref import WeakValueDictionary

import structlog
from aiohttp import web

from app.api.problems import ApiError
from app.domain.errors import StorageError
from app.domain.ports.stores import AnswerStore, StoredAnswer
from app.services.access import Principal
from app.services.clock import Clock

HEADER: Final = "Idempotency-Key"
REPLAYED: Final = "Idempotency-Replayed"
_KEY: Final = re.compile(r"^[\x21-\x7e]{1,200}$")
_KEPT_HEADERS: Final = ("Location", "ETag", "Content-Type")
log = structlog.get_logger(__name__)


class Idempotency:
    """Keeps the good answers of creating requests. An error is not kept: nothing was created, so it may be tried again.

    Keys belong to one token and one path. While the first request runs, a second one with its key waits for it.
    """

    def __init__(self, store: AnswerStore, clock: Clock) -> None:
        self._store = store
        self._clock = clock
        self._running: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()

    async def answer(
        self,
        request: web.Request,
        principal: Principal,
        request_hash: str,
        make: Callable[[], Awaitable[web.StreamResponse]],
    ) -> web.StreamResponse:
        """The stored answer of this request's key, else what `make` answers.

        Raises:
            ApiError: the key cannot be used, or was used for another body.
            StorageError: it cannot be known whether the request was done before.
        """
        given = request.headers.getall(HEADER, [])
        if not given:
            return await make()
        if len(given) > 1 or not _KEY.match(given[0]):
            raise ApiError(
                "idempotency.key_invalid", "the key must be 1 to 200 visible ASCII characters", hint="use a UUID"
            )
        scope = "\n".join((principal.token_id or principal.name, request.method, request.path, given[0]))
        key = hashlib.sha256(scope.encode()).hexdigest()
        lock = self._running.setdefault(key, asyncio.Lock())
        async with lock:
            stored = await self._store.get(key)
            if stored is not None:
                return _replay(stored, request_hash)
            response = await make()
            await self._keep(key, request_hash, response)
            return response

    async def _keep(self, key: str, request_hash: str, response: web.StreamResponse) -> None:
        if not isinstance(response, web.Response) or response.status >= 300 or not isinstance(response.body, bytes):
            return
        headers = {name: response.headers[name] for name in _KEPT_HEADERS if name in response.headers}
        answer = StoredAnswer(key, request_hash, response.status, headers, response.body)
        try:
            await self._store.put(answer, now=self._clock.now())
        except StorageError as error:
            # what was asked is done: saying otherwise would make the client do it again
            log.error("answer not kept: a repetition would be done again", error=error.detail)


def _replay(stored: StoredAnswer, request_hash: str) -> web.Response:
    if stored.request_hash != request_hash:
        raise ApiError(
            "idempotency.key_reused",
            "this key was used with another body",
            hint="use a new key for a new request; repeat a request with exactly the same body",
        )
    return web.Response(body=stored.body, status=stored.status, headers={**stored.headers, REPLAYED: "true"})
