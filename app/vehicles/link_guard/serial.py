"""A serial device: a cable, or a radio modem. It is opened again when it was unplugged."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import termios
import time
import tty
from collections.abc import Iterable
from typing import Final

from app.vehicles.link_guard.datagrams import LATE_S
from app.vehicles.link_guard.policy import Peer
from app.vehicles.link_guard.rate_budget import RateBudgets
from app.vehicles.link_guard.streams import Backlog, ByteStream, StallWatch
from app.vehicles.link_guard.transport import FrameReceiver

_AGAIN_S: Final = 1.0
_READ: Final = 65_536
_BAUDS: Final = {
    int(name[1:]): int(value) for name, value in vars(termios).items() if name[0] == "B" and name[1:].isdigit()
}


class SerialPort:
    """serial, a LinkTransport."""

    def __init__(self, device: str, baud: int, receiver: FrameReceiver) -> None:
        self._device = device
        self._baud = baud
        self._receiver = receiver
        self._peer = Peer(device, device, is_allowed=True)
        self._fd = -1
        self._rest = b""
        """The end of a frame whose beginning is under way."""
        self._again_s = 0.0
        self._backlog: Backlog | None = None
        self._stream: ByteStream | None = None
        self._watch: StallWatch | None = None
        self._budgets = RateBudgets()

    async def open(self) -> None:
        self._watch = StallWatch()
        try:
            self._open(self._watch)
        except OSError:
            self.close()
            raise

    def send(self, peer: Peer, frame: bytes) -> bool:
        if self._fd < 0 or self._backlog is None:
            return True
        now_s = time.monotonic()
        if self._backlog.age_s(now_s) > LATE_S or not self._write_rest():
            return False
        self._rest = frame
        self._backlog.wrote(len(frame), now_s)
        self._write_rest()
        return True

    def awaiting_heartbeat(self) -> Iterable[Peer]:
        return (self._peer,)

    def tick(self, now_s: float) -> None:
        if self._stream is not None:
            self._stream.tick()
        if self._fd < 0 and self._watch is not None and now_s >= self._again_s:
            self._again_s = now_s + _AGAIN_S
            with contextlib.suppress(OSError):
                self._open(self._watch)

    def close(self) -> None:
        self._let_go()
        if self._watch is not None:
            self._watch.close()
            self._watch = None

    def pause_reading(self) -> None:
        if self._fd >= 0:
            asyncio.get_running_loop().remove_reader(self._fd)

    def resume_reading(self) -> None:
        if self._fd >= 0:
            asyncio.get_running_loop().add_reader(self._fd, self._read)

    def _open(self, watch: StallWatch) -> None:
        speed = _BAUDS.get(self._baud)
        if speed is None:
            known = ", ".join(str(baud) for baud in sorted(_BAUDS) if baud >= 9600)
            raise OSError(errno.EINVAL, f"{self._baud} is no baud rate of this system; it has {known}")
        fd = os.open(self._device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(fd)
            settings = termios.tcgetattr(fd)
            settings[2] |= termios.CLOCAL | termios.CREAD
            settings[4] = settings[5] = speed
            termios.tcsetattr(fd, termios.TCSANOW, settings)
            termios.tcflush(fd, termios.TCIOFLUSH)  # what waits there is of before
        except termios.error as error:
            os.close(fd)
            raise OSError(*error.args) from error
        self._fd, self._rest = fd, b""
        self._backlog = Backlog(fd)
        self._stream = ByteStream(self._peer, self._receiver, watch, self, self._budgets)
        self.resume_reading()

    def _read(self) -> None:
        try:
            data = os.read(self._fd, _READ)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data and self._stream is not None:
            self._stream.feed(data)
        else:
            self._let_go()  # unplugged

    def _write_rest(self) -> bool:
        try:
            self._rest = self._rest[os.write(self._fd, self._rest) :] if self._rest else b""
        except BlockingIOError:
            return False
        except OSError:
            self._let_go()
        return not self._rest

    def _let_go(self) -> None:
        if self._stream is not None:
            self._stream.close()
        if self._fd >= 0:
            self.pause_reading()
            os.close(self._fd)
            self._fd = -1
            self._receiver.lost(self._peer)
