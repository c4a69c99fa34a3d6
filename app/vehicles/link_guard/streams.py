"""What TCP and serial have in common: frames found in a stream of bytes, and none sent that would have to wait."""

from __future__ import annotations

import asyncio
import fcntl
import struct
import termios
import time
from collections import deque
from typing import Final

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.datagrams import LATE_S
from app.vehicles.link_guard.frames import FrameStream
from app.vehicles.link_guard.outside import Inward
from app.vehicles.link_guard.policy import Peer

_LOOK_S: Final = 0.05
_MOST_WRITES: Final = 1024


class Backlog:
    """How long the oldest byte that was written has been waiting in the kernel."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._written = 0
        self._writes: deque[tuple[int, float]] = deque()

    def wrote(self, count: int, now_s: float) -> None:
        """So many bytes were handed over."""
        self._written += count
        since_s = now_s
        if len(self._writes) >= _MOST_WRITES:
            _, since_s = self._writes.pop()  # counted with the one before
        self._writes.append((self._written, since_s))

    def age_s(self, now_s: float) -> float:
        """Of a socket: since when something is not acknowledged; of a device: not transmitted."""
        try:
            (waiting,) = struct.unpack("i", fcntl.ioctl(self._fd, termios.TIOCOUTQ, bytes(4)))
        except OSError:
            return 0.0  # a device that does not report it
        while self._writes and self._writes[0][0] <= self._written - waiting:
            self._writes.popleft()
        return now_s - self._writes[0][1] if self._writes else 0.0


class StallWatch:
    """Whether the loop has just stood still: a stream does not record when its bytes arrived."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._due_s = time.monotonic() + _LOOK_S
        self._until_s = 0.0
        self._timer = self._loop.call_later(_LOOK_S, self._look)

    def just_stalled(self) -> bool:
        """Whether what is read now may be late."""
        now_s = time.monotonic()
        return now_s - self._due_s > LATE_S or now_s < self._until_s

    def close(self) -> None:
        """Look no more."""
        self._timer.cancel()

    def _look(self) -> None:
        now_s = time.monotonic()
        if now_s - self._due_s > LATE_S:
            self._until_s = now_s + _LOOK_S  # what waited is read in the turns that follow
        self._due_s = now_s + _LOOK_S
        self._timer = self._loop.call_later(_LOOK_S, self._look)


class ByteStream:
    """The frames of one peer's stream, on their way to the guard."""

    def __init__(self, peer: Peer, inward: Inward, watch: StallWatch) -> None:
        self._peer = peer
        self._inward = inward
        self._watch = watch
        self._frames = FrameStream()

    def feed(self, data: bytes) -> None:
        """Bytes as they were read."""
        late, skipped = self._watch.just_stalled(), self._frames.skipped
        for frame in self._frames.feed(data):
            self._inward.deliver(frame, self._peer, late)
        if self._frames.skipped != skipped:
            self._inward.refuse(RefusalKind.DAMAGED, self._peer)
