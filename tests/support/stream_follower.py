"""A client of the event stream that comes back with `after` whenever it is cut, and misses nothing."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import aiohttp

AGAIN_S: Final = 0.2
OPEN_S: Final = 30.0
WRONG: Final = frozenset({1008, 1011, 4400, 4401, 4403, 4404, 4409})
"""Closed with one of these: the client did what it may, and cannot go on."""


class StreamFollower:
    """Follows one of the nodes, and the next one after each cut, from the beginning or where another one is.

    `fell` is told what must not be.
    """

    def __init__(
        self,
        http: aiohttp.ClientSession,
        urls: Sequence[str],
        told: dict[int, str],
        fell: Callable[[str], None],
        other: StreamFollower | None = None,
    ) -> None:
        self._http = http
        self._urls = urls
        self._told = told
        """The hash at each position, as any follower was told."""
        self._fell = fell
        self._stream = ""
        self.seqs: dict[str, int] = {} if other is None else dict(other.seqs)
        """The newest event of each gateway that it was told of."""
        self.after = 0 if other is None else other.after
        self.cuts = 0
        self.back_s: float | None = None
        """When it had what it missed (monotonic); None while it does not."""

    async def run(self) -> None:
        """Until it is cancelled."""
        while True:
            url = self._urls[self.cuts % len(self._urls)]
            try:
                await self._follow(url)
            except (aiohttp.ClientError, ConnectionError, TimeoutError):
                await asyncio.sleep(AGAIN_S)
            self.back_s = None
            self.cuts += 1

    async def _follow(self, url: str) -> None:
        address = f"{url}/api/v1/stream?after={self.after}"
        if self._stream:
            address += f"&gateway={self._stream}"
        async with asyncio.timeout(OPEN_S):
            socket = await self._http.ws_connect(address)
        async with socket:
            target = None
            async for message in socket:
                if message.data.startswith('{"type":"event"'):
                    self._take(json.loads(message.data)["event"])
                elif message.data.startswith('{"type":"hello"'):
                    hello = json.loads(message.data)
                    target, self._stream = hello["seq"], hello["gateway"]
                if self.back_s is None and target is not None and self.after >= target:
                    self.back_s = time.monotonic()
            if socket.close_code in WRONG:
                self._fell(f"the stream after {self.after} was refused with {socket.close_code}")
        await asyncio.sleep(AGAIN_S)

    def _take(self, event: dict[str, Any]) -> None:
        position, gateway = event["position"], event["gateway"]
        if position != self.after + 1:
            self._fell(f"event {position} of the stream follows {self.after}: one is lost or told twice")
        if event["seq"] != self.seqs.get(gateway, 0) + 1:
            self._fell(f"event {event['seq']} of {gateway} follows {self.seqs.get(gateway, 0)}")
        if self._told.setdefault(position, event["hash"]) != event["hash"]:
            self._fell(f"the event at {position} was told in two ways")
        self.after, self.seqs[gateway] = position, event["seq"]
