"""What TCP and serial have in common: frames found in a stream of bytes, and none sent that would have to wait."""

from __future__ import annotations

import asyncio
import fcntl
import struct
import termios
import time
from collections import deque
from typing import Final, Protocol

from app.domain.vehicle.link_security import RefusalKind
from app.vehicles.link_guard.datagrams import LATE_S, TURN_S
from app.vehicles.link_guard.frames import FrameStream
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.rate_budget import RateBudgets
from app.vehicles.link_guard.transport import FrameReceiver

_LOOK_S: Final = 0.05
_MOST_WRITES: Final = 1024
_PIECE: Final = 256
"""Bytes of a stream that are looked at in one go, and cost a unit of the peer's budget."""


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


class Flow(Protocol):
    """Where a stream's bytes come from: an asyncio.ReadTransport, or a device."""

    def pause_reading(self) -> None:
        """Read nothing more for now."""

    def resume_reading(self) -> None:
        """Read again."""


class ByteStream:
    """The frames of one peer's stream, on their way to the guard: a piece at a time, within the peer's budget."""

    def __init__(
        self, peer: Peer, receiver: FrameReceiver, watch: StallWatch, flow: Flow, budgets: RateBudgets
    ) -> None:
        self._peer = peer
        self._receiver = receiver
        self._watch = watch
        self._flow = flow
        self._budgets = budgets
        self._frames = FrameStream()
        self._budget = budgets.unknown_peers
        self.is_of_vehicle = False
        self.heard_s = time.monotonic()
        """When it sent its last whole frame, or began."""
        self._data, self._at = b"", 0
        self._is_late, self._read_s = False, 0.0
        self._paused_s, self._late_until_s = 0.0, 0.0
        self._timer: asyncio.TimerHandle | None = None

    def feed(self, data: bytes) -> None:
        """Bytes as they were read."""
        self._data, self._at = self._data[self._at :] + data, 0
        self._read_s = time.monotonic()
        self._is_late = self._watch.just_stalled() or self._read_s < self._late_until_s
        if self._timer is None:
            self._go_on()

    def tick(self) -> None:
        """Count the vehicles that are heard from this peer."""
        is_of_vehicle = self._receiver.owns(self._peer)
        if is_of_vehicle != self.is_of_vehicle:
            self.is_of_vehicle = is_of_vehicle
            self._budget = self._budgets.of_vehicle() if is_of_vehicle else self._budgets.unknown_peers
        if is_of_vehicle:
            self._budget.widen(self._receiver.systems_of(self._peer))

    def close(self) -> None:
        """What was not taken yet is left."""
        self._data, self._at = b"", 0
        if self._timer is not None:
            self._timer.cancel()

    def _go_on(self) -> None:
        is_paused, self._timer = self._timer is not None, None
        until_s = time.monotonic() + TURN_S
        while self._at < len(self._data):
            pause_s = self._budget.spend(self._take(), time.monotonic())
            if pause_s or (self._at < len(self._data) and time.monotonic() > until_s):
                if not is_paused:
                    self._flow.pause_reading()
                    self._paused_s = time.monotonic()
                self._timer = asyncio.get_running_loop().call_later(pause_s, self._go_on)
                return
        self._data, self._at = b"", 0
        if is_paused:
            now_s = time.monotonic()
            if now_s - self._paused_s > LATE_S:
                self._late_until_s = now_s + _LOOK_S  # what waited meanwhile is read in the turns that follow
            self._flow.resume_reading()

    def _take(self) -> int:
        """The next piece. What it cost, in the units of a budget."""
        piece = self._data[self._at : self._at + _PIECE]
        self._at += len(piece)
        late = self._is_late or time.monotonic() - self._read_s > LATE_S
        skipped, damaged = self._frames.skipped, self._frames.damaged
        units = 1
        for frame in self._frames.feed(piece):
            units += self._receiver.deliver(frame, self._peer, late)
            self.heard_s = self._read_s
        self._receiver.flush()
        if self._frames.skipped != skipped:
            self._receiver.refuse(RefusalKind.DAMAGED, self._peer)
        if not self.is_of_vehicle:
            self.tick()
        return units + self._frames.damaged - damaged
