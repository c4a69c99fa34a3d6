"""Datagrams from a socket to the event loop, and how long each has waited there."""

from __future__ import annotations

import asyncio
import math
import socket
import struct
import sys
import time
from collections.abc import Callable
from typing import Any, Final

LATE_S: Final = 0.2
"""What waited longer, because the process stood still, is late."""
_SUSPECT_S: Final = 0.1
"""Without an empty queue for so long the age of each datagram is looked at: the loop may have stood still."""
_BEHIND_S: Final = 1.0
"""Late ones for longer: more come than can be read. What came before waited for a loop that stood still."""
TURN_S: Final = 0.002
"""The longest that one turn of the loop spends on one socket."""
_LONGEST: Final = 65_535
_RECEIVE_BUFFER: Final = 1 << 20

_SO_TIMESTAMPNS: Final = 35 if sys.platform == "linux" else None
"""The kernel's time of arrival, as a struct timespec; without it a datagram that may be late counts as late."""
_TIMESPEC: Final = struct.Struct("@ll")

Address = tuple[Any, ...]
Take = Callable[[bytes, Address, bool], None]
"""Gets a datagram, where it came from, and whether it is late."""
Skip = Callable[[Address], None]
"""Gets where a datagram came from that is dropped unread."""


def udp_socket(family: int) -> socket.socket:
    """A non-blocking socket whose datagrams have their time of arrival. Raises OSError."""
    sock = socket.socket(family, socket.SOCK_DGRAM)
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
    if _SO_TIMESTAMPNS is not None:
        sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    return sock


class DatagramReader:
    """Reads a socket from the event loop until `close`, which closes it too.

    `turn_ended` is called when no more is taken in this turn of the loop. With `skip`, late datagrams are skipped while
    more come than can be read: the queue would stay full of them, and nothing else would ever be taken. What is in the
    queue when the first late one is taken is never skipped. What comes later is, even if the loop stands still again.
    """

    def __init__(
        self,
        sock: socket.socket,
        take: Take,
        turn_ended: Callable[[], None] = lambda: None,
        skip: Skip | None = None,
    ) -> None:
        self._loop = asyncio.get_running_loop()
        self._sock = sock
        self._take = take
        self._turn_ended = turn_ended
        self._skip = skip
        self._empty_s = time.monotonic()
        """When the queue was last known to be empty."""
        self._late_s = math.inf
        """When the first late one was taken since then."""
        self._pause: asyncio.TimerHandle | None = None
        self._loop.add_reader(sock, self._ready)

    def pause(self, seconds: float) -> None:
        """Read nothing for so long: the kernel drops what does not fit into its queue."""
        if self._pause is not None or self._sock.fileno() < 0:
            return
        self._loop.remove_reader(self._sock)
        self._pause = self._loop.call_later(seconds, self._go_on)

    def close(self) -> None:
        """Read no more, and close the socket. Idempotent."""
        if self._sock.fileno() < 0:
            return
        if self._pause is not None:
            self._pause.cancel()
        self._loop.remove_reader(self._sock)
        self._sock.close()

    def _go_on(self) -> None:
        self._pause = None
        self._loop.add_reader(self._sock, self._ready)

    def _ready(self) -> None:
        try:
            self._take_all()
        finally:
            self._turn_ended()

    def _take_all(self) -> None:
        now_s = time.monotonic()
        until_s, look = now_s + TURN_S, now_s - self._empty_s > _SUSPECT_S
        skip = self._skip if now_s - self._late_s > _BEHIND_S else None
        while self._pause is None:
            try:
                if look:
                    data, stamps, _, address = self._sock.recvmsg(_LONGEST, 64)
                    age_s = _age_s(stamps)
                else:
                    data, address = self._sock.recvfrom(_LONGEST)
                    age_s = 0.0
            except BlockingIOError:
                self._empty_s, self._late_s = now_s, math.inf
                return
            except OSError:
                continue  # a peer does not listen (ICMP); the next call raises it
            # half, so that the next ones are not late when their turn comes
            if skip is not None and age_s > LATE_S / 2 and time.monotonic() - age_s >= self._late_s:
                skip(address)
            else:
                if age_s > LATE_S:
                    self._late_s = min(self._late_s, now_s)
                self._take(data, address, age_s > LATE_S)
            if self._sock.fileno() < 0 or time.monotonic() > until_s:
                return


def _age_s(stamps: list[tuple[int, int, bytes]]) -> float:
    for level, kind, data in stamps:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(data) >= _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack_from(data)
            age_s = time.clock_gettime(time.CLOCK_REALTIME) - seconds - nanoseconds / 1e9  # the clock of the stamps
            return age_s if age_s > -LATE_S else float("inf")  # the clock was set meanwhile
    return float("inf")
