"""The keys and timestamps that all guards of a process share, kept in step with their files."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections.abc import Callable
from typing import Final

from app.domain.ports.link_keys import LinkKeyError
from app.domain.ports.threads import InThread
from app.vehicles.link_guard.key_file import KeyFile, Keys, MemoryFile, SigningMemory
from app.vehicles.link_guard.keyring import KeyRing
from app.vehicles.link_guard.policy import Signing
from app.vehicles.link_guard.signing import TICKS_PER_S, SigningClocks, SigningKey, StreamTimes

_AHEAD: Final = 10 * TICKS_PER_S
"""Timestamps are reserved so far ahead: after a crash ours go on behind all that were sent."""
_EVERY_S: Final = 5.0
"""How often they are stored: after a crash a recording of so many seconds before it could pass once."""
_LOOK_S: Final = 1.0
_log = logging.getLogger(__name__)


class SigningStore:
    """`signing` for the guards, and its files. Without files nothing is signed."""

    def __init__(
        self,
        keys: KeyFile | None = None,
        memory: MemoryFile | None = None,
        *,
        clock: Callable[[], float] = time.time,
        in_thread: InThread = asyncio.to_thread,
    ) -> None:
        """Raises LinkKeyError: a file cannot be used."""
        self._in_thread = in_thread
        self._keys = keys
        self._memory = memory
        self._clock = clock
        self._version = self._complained = None if keys is None else keys.version()
        known = SigningMemory() if memory is None else memory.read()
        self.signing = Signing(
            KeyRing({} if keys is None else keys.read(), known.used),
            SigningClocks(known.reserved),
            StreamTimes(known.streams),
        )
        self._know_clocks()
        self._stored: SigningMemory = known
        self._writing = threading.Lock()
        self._snapshots = self._written = 0
        self._stored_s = self._looked_s = time.monotonic()
        self._again_s = 0.0

    def timestamp(self, key: SigningKey, *, former: SigningKey | None = None) -> int:
        """The timestamp of a frame that is signed now. `former`: the key from which its vehicle changes to this one."""
        if former is not None:
            self.signing.clocks.follow(key, former)
        clock = self.signing.clocks.of(key)
        timestamp = clock.next(self._clock())
        if clock.needs_reservation and time.monotonic() >= self._again_s:  # the machine's clock was set far ahead
            self._again_s = time.monotonic() + _LOOK_S
            self._write(*self._numbered(self._snapshot(_AHEAD)), wait=False)
        return timestamp

    async def tick(self, now_s: float) -> bool:
        """Store what is due, and look for new keys. Whether there are some. A slow disk is waited for."""
        has_new_keys = False
        if now_s - self._looked_s >= _LOOK_S:
            self._looked_s = now_s
            fresh_keys = await self._in_thread(self._read_again)
            if fresh_keys is not None:
                self.signing.ring.replace(fresh_keys)
                self._know_clocks()
                has_new_keys = True
        if has_new_keys or now_s - self._stored_s >= _EVERY_S:
            self._stored_s = now_s
            fresh = self._snapshot(_AHEAD)
            if fresh != self._stored:
                await self._in_thread(self._write, *self._numbered(fresh))
        return has_new_keys

    def close(self) -> None:
        """Store the last of it."""
        last = self._snapshot(0)
        if last != self._stored:
            self._write(*self._numbered(last))

    def _read_again(self) -> Keys | None:
        """The keys, if their file has changed. In a thread: the disk may be slow."""
        if self._keys is None:
            return None
        version = self._keys.version()
        if version == self._version:
            return None
        try:
            if version is None:
                raise LinkKeyError(f"{self._keys.path} is gone")
            keys = self._keys.read()
        except LinkKeyError as error:
            if version != self._complained:
                _log.error("the link keys go on as they were: %s", error.detail)
            self._complained = version
            return None
        self._version = self._complained = version
        return keys

    def _know_clocks(self) -> None:
        """Make a clock for each key, so that time is reserved on it before its vehicle is heard."""
        for key in self.signing.ring.signing_keys():
            self.signing.clocks.of(key)

    def _snapshot(self, ahead: int) -> SigningMemory:
        return SigningMemory(
            self.signing.clocks.ahead(ahead, self._clock()), self.signing.times.last(), self.signing.ring.used()
        )

    def _numbered(self, memory: SigningMemory) -> tuple[SigningMemory, int]:
        self._snapshots += 1
        return memory, self._snapshots

    def _write(self, memory: SigningMemory, number: int, *, wait: bool = True) -> None:
        """From the loop, or from the thread that stores now and then: an older snapshot never replaces a newer one.

        `wait`: for a write that is under way.
        """
        if not self._writing.acquire(blocking=wait):
            return
        try:
            if self._memory is None or number < self._written:
                return
            try:
                self._memory.write(memory)
            except OSError as error:
                _log.error("what is known of the links' signatures cannot be stored: %s", error)
                self._again_s = time.monotonic() + _EVERY_S  # commands do not wait for it
                return
            self._stored, self._written = memory, number
            self.signing.clocks.reserve(memory.reserved)
        finally:
            self._writing.release()
