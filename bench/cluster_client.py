"""The client of `python -m bench.cluster`: it follows an API node and the floor, and notes when all arrives."""

from __future__ import annotations

import asyncio
import json
import re
import time
from typing import Final

import aiohttp

STATE: Final = re.compile(r'"absolute_altitude_m":([0-9.]+)')
AGAIN_S: Final = 0.2


class StreamClient:
    """`arrived` has the time of each event by its gateway and number. A state's age is told by its altitude."""

    def __init__(self, http: aiohttp.ClientSession, url: str) -> None:
        self._http = http
        self._url = url
        self._after = 0
        self._shown: frozenset[float] = frozenset()
        self.arrived: dict[tuple[str, int], float] = {}
        self.ages_s: list[float] = []
        self.states = 0
        self.cuts = 0

    async def run(self) -> None:
        """Until it is cancelled; from where it was after each cut."""
        while True:
            try:
                async with self._http.ws_connect(f"{self._url}?after={self._after}", max_msg_size=0) as socket:
                    async for message in socket:
                        self._take(message.data)
            except (aiohttp.ClientError, ConnectionError):
                pass
            self.cuts += 1
            await asyncio.sleep(AGAIN_S)

    def _take(self, frame: str) -> None:
        now_s = time.time()
        if frame.startswith('{"type":"event"'):
            self._event(json.loads(frame)["event"], now_s)
        elif frame.startswith(('{"type":"telemetry"', "[")):
            times = [float(text) for text in STATE.findall(frame)]
            self.ages_s += [now_s - one for one in times]
            self.states += sum(one not in self._shown for one in times)  # an API node sends the old ones, too
            self._shown = frozenset(times)
        elif not frame.startswith('{"type"'):  # the floor's
            self._event(json.loads(frame), now_s)

    def _event(self, event: dict[str, object], now_s: float) -> None:
        self.arrived[str(event["gateway"]), int(str(event["seq"]))] = now_s
        self._after = int(str(event["position"])) if event["position"] else self._after
