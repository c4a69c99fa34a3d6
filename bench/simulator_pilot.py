"""The ground side of bench.simulator_load: one socket for all vehicles; sends them off and counts what they say."""

from __future__ import annotations

import math
import selectors
import socket
import time
from collections import Counter
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from app.simulator.dialect import Message, mavlink

LOCAL = "127.0.0.1"
SYSTEM_AT, MESSAGE_AT = 5, 7
"""Where a MAVLink 2 frame has its sender's system id and the lowest byte of its message id."""
MISSION_REQUEST_INT, MISSION_ACK, HEARTBEAT = 51, 47, 0
MAVLINK_2, ARMED = 0xFD, 128
WAYPOINT, TAKEOFF, ARM, SET_MODE = 16, 22, 400, 176
MISSION_MODE = (1.0, 4.0, 4.0)
CIRCUIT = ((0.0, 0.001), (0.001, 0.001), (0.001, 0.0), (0.0, 0.0)) * 20
"""Degrees from the first waypoint: long enough for any measurement."""
RECEIVE_BYTES = 8 * 1024 * 1024
HOME = (47.397742, 8.545594)


@dataclass(slots=True)
class Received:
    """What arrived."""

    datagrams: int = 0
    bytes: int = 0


class Pilot:
    """Gives each vehicle a mission of many waypoints, and starts it."""

    def __init__(self, vehicles: int) -> None:
        self._vehicles = vehicles
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
        self._socket.bind((LOCAL, 0))
        self._socket.setblocking(False)
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._socket, selectors.EVENT_READ)
        self._packer = mavlink.MAVLink(None, srcSystem=245, srcComponent=190)
        self._address: dict[int, tuple[str, int]] = {}
        self._uploaded: set[int] = set()
        self._flying: set[int] = set()
        self.heard_per_vehicle: Counter[int] = Counter()
        """Since the last call of `listen`."""

    @property
    def port(self) -> int:
        """Where the vehicles send to."""
        return int(self._socket.getsockname()[1])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._selector.close()
        self._socket.close()

    def send_off(self, within_s: float) -> int:
        """Upload, arm and start all; how many were seen armed in mission mode. Asks again each second."""
        end_s, again_s = time.monotonic() + within_s, 0.0
        while time.monotonic() < end_s and len(self._flying) < self._vehicles:
            if time.monotonic() >= again_s:
                again_s = time.monotonic() + 1.0
                for system in set(self._address) - self._flying:
                    self._ask(system)
            self.listen(0.1)
        return len(self._flying)

    def listen(self, seconds: float) -> Received:
        """Take in what comes for so long, answering mission requests."""
        received, end_s = Received(), time.monotonic() + seconds
        self.heard_per_vehicle.clear()
        while (left_s := end_s - time.monotonic()) > 0.0:
            if not self._selector.select(left_s):
                break
            self._take_all(received)
        return received

    def _take_all(self, received: Received) -> None:
        while True:
            try:
                data, address = self._socket.recvfrom(2048)
            except BlockingIOError:
                return
            received.datagrams += 1
            received.bytes += len(data)
            system = data[SYSTEM_AT]
            self.heard_per_vehicle[system] += 1
            if data[0] == MAVLINK_2 and data[MESSAGE_AT + 1] == 0:
                self._on_message(system, data[MESSAGE_AT], data, address)

    def _on_message(self, system: int, kind: int, data: bytes, address: tuple[str, int]) -> None:
        if kind == HEARTBEAT:
            self._address[system] = address
            beat = mavlink.MAVLink(None).decode(bytearray(data))
            if beat.base_mode & ARMED and beat.custom_mode == 4 << 16 | 4 << 24:
                self._flying.add(system)
        elif kind == MISSION_REQUEST_INT:
            seq = mavlink.MAVLink(None).decode(bytearray(data)).seq
            self._send(system, self._item(system, seq))
        elif kind == MISSION_ACK:
            self._uploaded.add(system)

    def _ask(self, system: int) -> None:
        self._send(system, mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        if system not in self._uploaded:
            self._send(system, mavlink.MAVLink_mission_count_message(system, 1, len(CIRCUIT) + 1, 0, 0))
            return
        for command, params in ((ARM, (1.0, 0.0, 0.0)), (SET_MODE, MISSION_MODE)):
            rest = (0.0,) * 4
            self._send(system, mavlink.MAVLink_command_long_message(system, 1, command, 0, *params, *rest))

    def _item(self, system: int, seq: int) -> Message:
        command, (north, east) = (TAKEOFF, (0.001, 0.0)) if seq == 0 else (WAYPOINT, CIRCUIT[seq - 1])
        x, y = round((HOME[0] + north) * 1e7), round((HOME[1] + east + system * 1e-4) * 1e7)
        return mavlink.MAVLink_mission_item_int_message(
            system, 1, seq, 6, command, int(seq == 0), 1, 0.0, 0.0, 0.0, math.nan, x, y, 30.0, 0
        )

    def _send(self, system: int, message: Message) -> None:
        self._socket.sendto(message.pack(self._packer), self._address[system])
