"""A second ground station on a link of its own (the simulator's --gcs-port), over real UDP."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from types import TracebackType
from typing import Self

from app.simulator.dialect import Message, mavlink

IDENTITY = (246, 191)
ANSWER_S, AGAIN_S = 15.0, 3.0
"""PX4 announces nothing if the same value comes again before it has announced the first."""
INT32, REAL32 = 6, 9


class SecondStation:
    """Bound to `port` while it is entered. It says nothing but what it is told to."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._mavlink = mavlink.MAVLink(None, srcSystem=IDENTITY[0], srcComponent=IDENTITY[1])
        self._mavlink.robust_parsing = True

    def __enter__(self) -> Self:
        self._socket.bind(("127.0.0.1", self._port))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._socket.close()

    def set_silently(self, name: str, value: float) -> None:
        """PARAM_SET twice in one go: the vehicle answers, and announces nothing."""
        self.set(name, value, times=2)

    def set(self, name: str, value: float, system_id: int = 1, times: int = 1) -> None:
        """PARAM_SET until it is answered; AssertionError if it is not. An int is packed bytewise."""
        is_int = isinstance(value, int)
        packed = struct.unpack("<f", struct.pack("<i", value))[0] if is_int else value
        order = mavlink.MAVLink_param_set_message(system_id, 1, name.encode(), packed, INT32 if is_int else REAL32)
        deadline_s, due_s = time.monotonic() + ANSWER_S, 0.0
        while (now_s := time.monotonic()) < deadline_s:
            heard = self._receive()
            if due_s and any(one.get_type() == "PARAM_VALUE" and one.param_id == name for one, _ in heard):
                return
            if heard and now_s >= due_s:
                for _ in range(times):
                    self._socket.sendto(order.pack(self._mavlink), heard[-1][1])
                due_s = now_s + AGAIN_S
        raise AssertionError(f"PARAM_SET {name} was not answered")

    def _receive(self) -> list[tuple[Message, tuple[str, int]]]:
        """All that has come: on a busy machine the answer may have waited here for long."""
        heard: list[tuple[Message, tuple[str, int]]] = []
        self._socket.settimeout(0.2)
        with contextlib.suppress(TimeoutError, BlockingIOError):
            while True:
                data, address = self._socket.recvfrom(2048)
                heard += [(message, address) for message in self._mavlink.parse_buffer(data) or ()]
                self._socket.setblocking(False)
        return heard
