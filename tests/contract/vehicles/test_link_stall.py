"""A loop that hangs while mavsdk's own threads go on: no command and no setpoint of that time reaches the vehicle."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import mavsdk
from mavsdk.plugins.mavlink_direct import MavlinkDirect, MavlinkMessage
from pymavlink.dialects.v20 import common

from app.vehicles.link_guard.guard import LinkGuard
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import parse_connection
from tests.support.driving import until
from tests.support.mavlink_frames import FrameSender
from tests.support.simulated import free_udp_ports

HANG_S = 5.0
SLACK_S = 1.2
"""What was sent last before the hang ends is not late yet; and threads of a busy machine wait their turn."""
RATE_HZ = 50.0


class ListeningVehicle:
    """Reads from a thread of its own, and notes when each message says that it was sent: it may be read any time."""

    def __init__(self, port: int) -> None:
        self._sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._sock.bind(("127.0.0.1", 0))
        self._sock.settimeout(0.05)
        self._to = ("127.0.0.1", port)
        self._parser = common.MAVLink(None)
        self._parser.robust_parsing = True
        self._stop = threading.Event()
        self.sent_s: dict[str, list[float]] = {"COMMAND_LONG": [], "SET_POSITION_TARGET_LOCAL_NED": []}
        self.heartbeats_s: list[float] = []
        self._thread = threading.Thread(target=self._run, name="listening vehicle")
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self._sock.close()

    def _run(self) -> None:
        speaker, beat_s = FrameSender(1, 1), 0.0
        while not self._stop.is_set():
            now_s = time.monotonic()
            if now_s - beat_s > 0.2:
                beat_s = now_s
                self._sock.sendto(speaker.heartbeat(), self._to)
            try:
                data = self._sock.recv(65_535)
            except TimeoutError:
                continue
            for message in self._parser.parse_buffer(data) or ():
                self._note(message, time.monotonic())

    def _note(self, message: common.MAVLink_message, now_s: float) -> None:
        name = message.get_type()
        if name == "HEARTBEAT":
            self.heartbeats_s.append(now_s)
        elif name == "COMMAND_LONG" and message.command == 31_000:
            self.sent_s[name].append(message.param1)
        elif name == "SET_POSITION_TARGET_LOCAL_NED":
            self.sent_s[name].append(message.x)


@contextmanager
def sending(direct: MavlinkDirect, began_s: float) -> Iterator[None]:
    """mavsdk sends from a thread of its own, each message with its time."""
    stop = threading.Event()

    def run() -> None:
        while not stop.wait(1.0 / RATE_HZ):
            now_s = time.monotonic() - began_s
            command = {f"param{n}": 0.0 for n in range(1, 8)} | {"param1": now_s, "command": 31_000, "confirmation": 0}
            setpoint = dict.fromkeys(("y", "z", "vx", "vy", "vz", "afx", "afy", "afz", "yaw", "yaw_rate"), 0.0)
            setpoint |= {"x": now_s, "time_boot_ms": 0, "coordinate_frame": 1, "type_mask": 3527}
            for name, fields in (("COMMAND_LONG", command), ("SET_POSITION_TARGET_LOCAL_NED", setpoint)):
                body = json.dumps({**fields, "target_system": 1, "target_component": 1})
                direct.send_message(MavlinkMessage(name, 245, 190, 1, 1, body))

    thread = threading.Thread(target=run, name="mavsdk sends")
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


async def test_nothing_of_a_hang_reaches_the_vehicle() -> None:
    port = free_udp_ports(1)
    guard = LinkGuard(parse_connection(f"udpin://127.0.0.1:{port}"), SigningStore(), 0)
    await guard.open()
    configuration = mavsdk.Configuration.create_with_component_type(mavsdk.ComponentType.GROUND_STATION)
    native = mavsdk.Mavsdk(configuration)
    configuration.destroy()
    vehicle = ListeningVehicle(port)
    try:
        native.add_any_connection(guard.inner_url)
        guard.begin()
        await until(lambda: bool(native.get_systems()), "mavsdk must find the vehicle", 10.0)
        direct = MavlinkDirect(native.get_systems()[0])
        began_s = time.monotonic()
        with sending(direct, began_s):
            await until(lambda: len(vehicle.sent_s["COMMAND_LONG"]) > 20, "commands must pass before", 10.0)
            hung_s = time.monotonic()
            time.sleep(HANG_S)  # noqa: ASYNC251  the loop hangs; mavsdk's threads and the sender's do not
            woke_s = time.monotonic()
            for name, sent_s in vehicle.sent_s.items():
                again = f"{name} must pass again afterwards"
                await until(lambda sent_s=sent_s: sum(woke_s - began_s < at_s for at_s in sent_s) > 10, again, 10.0)
        for name, sent_s in vehicle.sent_s.items():
            late = [at_s for at_s in sent_s if hung_s < began_s + at_s < woke_s - SLACK_S]
            assert not late, f"{len(late)} {name} of the hang, the oldest of {late[0] + began_s - hung_s:.2f} s after"
        silent = [at_s for at_s in vehicle.heartbeats_s if hung_s + SLACK_S < at_s < woke_s]
        assert not silent, "a vehicle must see that its ground station hangs"
    finally:
        vehicle.close()
        native.destroy()
        guard.close()
