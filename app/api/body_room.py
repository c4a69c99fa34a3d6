"""The memory that large bodies take together, from head to answer: many slow uploads must not take all of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from aiohttp import web

from app.api.problems import ApiError

SMALL_BYTES: Final = 64 * 1024
"""So large a body needs no room: the number of connections bounds these."""


class BodyRoom:
    """Room is held by what a body says of its size; one that says nothing may be as large as any."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._held_bytes = 0

    @contextmanager
    def held(self, request: web.Request, largest_bytes: int) -> Iterator[None]:
        """Hold room for a body of at most `largest_bytes` until the block ends. Raises ApiError (503)."""
        size_bytes = self._size_of(request, largest_bytes)
        if size_bytes and self._held_bytes + size_bytes > self._most_bytes:
            raise ApiError("request.no_room", "too many large bodies are being sent", hint="send it again in a moment")
        self._held_bytes += size_bytes
        try:
            yield
        finally:
            self._held_bytes -= size_bytes

    def _size_of(self, request: web.Request, largest_bytes: int) -> int:
        if not request.can_read_body:
            return 0
        told = request.content_length
        size_bytes = largest_bytes if told is None else min(told, largest_bytes)
        return 0 if size_bytes <= SMALL_BYTES else size_bytes
