"""What a message of a vehicle costs with the link guard and without it, and how many of 15 vehicles arrive.

Usage: python -m bench.link_guard [--vehicles 15] [--rate 150] [--seconds 8] [--quick]

A process of its own is the vehicles: each sends HEARTBEATs and the telemetry that Waydrop reads, frames made ahead, by
UDP to a port of its own. This process has mavsdk and Waydrop's own inbox, nothing else. In turns the vehicles reach
mavsdk directly, through the guard, and signed through the guard. CPU is user and system time of this process, mavsdk's
threads included; a message counts when it has reached a listener on the event loop. `turn p99` is how late the loop
gets to what is due.

Exit status: 0 if with the guard at least 99.5 % arrive, else 1. `--quick` takes 5 vehicles for 3 seconds.
"""

from __future__ import annotations

import argparse
import asyncio
import socket
import sys
import time
from asyncio.subprocess import DEVNULL
from dataclasses import dataclass
from typing import Final

from rich.console import Console
from rich.table import Table

from app.vehicles.doorbell import Doorbell
from app.vehicles.inbox import Inbox
from app.vehicles.link_guard.guard import LinkGuard
from app.vehicles.link_guard.keyring import StoredKey
from app.vehicles.link_guard.memory import SigningStore
from app.vehicles.link_guard.options import parse_connection
from app.vehicles.link_guard.signing import SigningKey
from app.vehicles.native import NativeInstance, RawSink
from app.vehicles.settings import LinkSettings

LOCAL: Final = "127.0.0.1"
SECRET: Final = b"b" * 32
DELIVERED: Final = 0.995
ROUNDS: Final = 2
SETTLE_S: Final = 0.5
NAMES: Final = ("GLOBAL_POSITION_INT", "SERVO_OUTPUT_RAW", "EXTENDED_SYS_STATE")
"""A third of the messages each; SERVO_OUTPUT_RAW and EXTENDED_SYS_STATE queue in the inbox, positions overwrite."""

VEHICLES = """
import socket, sys, time
from pymavlink.dialects.v20 import common as m
ports, rate, signed = [int(p) for p in sys.argv[1].split(",")], float(sys.argv[2]), sys.argv[3] == "signed"
speakers = []
for number, port in enumerate(ports, start=1):
    mav = m.MAVLink(None, srcSystem=number, srcComponent=1)
    if signed:
        mav.signing.secret_key, mav.signing.sign_outgoing = b"b" * 32, True
        mav.signing.timestamp = int((time.time() - 1420070400) * 1e5)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.bind(("127.0.0.1", 0))
    speakers.append((mav, out, ("127.0.0.1", port)))

def send(mav, out, to, message):
    out.sendto(message.pack(mav), to)
    mav.seq = (mav.seq + 1) % 256

def telemetry(n):
    return (
        m.MAVLink_global_position_int_message(n, 473977420, 85455940, 488000, 15600, -12, 30, 0, 27000),
        m.MAVLink_servo_output_raw_message(n, 0, 1000, 1000, 0, 0, 2000, 0, 0, 1 + n % 2000),
        m.MAVLink_extended_sys_state_message(0, 1),
    )[n % 3]

begin, beat, sent = time.monotonic(), 0.0, 0
while True:
    now = time.monotonic() - begin
    if now >= beat:
        beat += 1.0
        for mav, out, to in speakers:
            send(mav, out, to, m.MAVLink_heartbeat_message(2, 12, 157, 67371008, 4, 3))
    while sent < now * rate:
        sent += 1
        for mav, out, to in speakers:
            send(mav, out, to, telemetry(sent))
    time.sleep(0.002)
"""


@dataclass(slots=True)
class Measured:
    """Sums over all rounds of one way."""

    delivered: int = 0
    due: float = 0.0
    cpu_s: float = 0.0
    wall_s: float = 0.0
    turns_s: list[float] | None = None

    @property
    def cost_us(self) -> float:
        """CPU for each message that arrived."""
        return self.cpu_s / max(self.delivered, 1) * 1e6


def free_ports(count: int) -> list[int]:
    """UDP ports that nobody has now."""
    held = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(count)]
    for sock in held:
        sock.bind((LOCAL, 0))
    ports = [int(sock.getsockname()[1]) for sock in held]
    for sock in held:
        sock.close()
    return ports


class Station:
    """mavsdk and an inbox for each vehicle, with or without guards before them."""

    def __init__(self) -> None:
        self.counts: list[int] = []
        self.slots: dict[str, str] = {}
        self._instances: list[NativeInstance] = []
        self._guards: list[LinkGuard] = []
        self._inboxes: list[Inbox] = []
        self._doorbell = Doorbell()

    async def open(self, ports: list[int], way: str) -> None:
        """Open one connection for each port."""
        store = SigningStore()
        if way == "signed":
            key = StoredKey(SigningKey(SECRET), in_use=True)
            store.signing.ring.replace({number: [key] for number in range(1, len(ports) + 1)})
        for index, port in enumerate(ports):
            url = f"udpin://{LOCAL}:{port}"
            if way in {"mavsdk alone", "slots"}:
                self._instances.append(NativeInstance(url))
                continue
            guard = LinkGuard(parse_connection(url), store, index)
            await guard.open()
            self._instances.append(NativeInstance(guard.inner_url))
            guard.begin()
            self._guards.append(guard)

    async def find(self, vehicles: int, way: str, within_s: float = 20.0) -> None:
        """Listen to all of them, once they are found. "slots": mavsdk's callback keeps the newest, and that is all."""
        loop, deadline_s = asyncio.get_running_loop(), time.monotonic() + within_s
        while len(self.counts) < vehicles:
            if time.monotonic() > deadline_s:
                raise TimeoutError(f"{len(self.counts)} of {vehicles} vehicles were found")
            for instance in self._instances:
                for system in instance.new_systems():
                    index = len(self.counts)
                    self.counts.append(0)
                    inbox = Inbox(loop, capacity=LinkSettings().mailbox_capacity, wake=self._doorbell.ring)
                    self._inboxes.append(inbox)
                    system.listen(NAMES, (), self._slot(index) if way == "slots" else self._sink(inbox, index))
            await asyncio.sleep(0.05)

    def close(self) -> None:
        """End everything."""
        for guard in self._guards:
            guard.close()
        for inbox in self._inboxes:
            inbox.close()
        for instance in self._instances:
            instance.destroy()
        self._doorbell.close()

    def _sink(self, inbox: Inbox, index: int) -> RawSink:
        def sink(name: str, body: str) -> None:
            self.counts[index] += 1
            inbox.post(name, body)

        return sink

    def _slot(self, index: int) -> RawSink:
        def sink(name: str, body: str) -> None:
            self.counts[index] += 1
            self.slots[name] = body

        return sink


async def measure(
    way: str, vehicles: int, rate: float, seconds: float, into: Measured, *, one_port: bool = False
) -> None:
    """One round. `one_port`: all vehicles send to the same port."""
    ports = free_ports(1 if one_port else vehicles)
    station = Station()
    await station.open(ports, way)
    arguments = [",".join(map(str, ports * vehicles if one_port else ports)), str(rate), way]
    sender = await asyncio.create_subprocess_exec(sys.executable, "-c", VEHICLES, *arguments, stdout=DEVNULL)
    try:
        await station.find(vehicles, way)
        await asyncio.sleep(SETTLE_S)
        before, cpu_s, begun_s = sum(station.counts), time.process_time(), time.monotonic()
        turns_s = into.turns_s = into.turns_s or []
        while (left_s := begun_s + seconds - time.monotonic()) > 0:
            due_s = time.monotonic() + min(0.01, left_s)
            await asyncio.sleep(min(0.01, left_s))
            turns_s.append(time.monotonic() - due_s)
        into.wall_s += time.monotonic() - begun_s
        into.cpu_s += time.process_time() - cpu_s
        into.delivered += sum(station.counts) - before
        into.due += vehicles * rate * (time.monotonic() - begun_s)
    finally:
        sender.kill()
        await sender.wait()
        station.close()


def main() -> int:
    """The table and the exit status."""
    parser = argparse.ArgumentParser(description="What the link guard costs, and whether everything arrives.")
    parser.add_argument("--vehicles", type=int, default=15)
    parser.add_argument("--rate", type=float, default=150.0)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--quick", action="store_true")
    given = parser.parse_args()
    vehicles, seconds = (5, 3.0) if given.quick else (given.vehicles, given.seconds)
    ways = {way: Measured() for way in ("mavsdk alone", "guard", "signed")}
    for _ in range(ROUNDS):
        for way, into in ways.items():
            asyncio.run(measure(way, vehicles, given.rate, seconds, into))
    table = Table(title=f"{vehicles} vehicles, {given.rate:g} messages a second each")
    for column in ("", "delivered", "us a message", "ratio", "of a core", "turn p99"):
        table.add_column(column, justify="right")
    floor_us = ways["mavsdk alone"].cost_us
    for way, found in ways.items():
        turns_s = sorted(found.turns_s or [0.0])
        table.add_row(
            way,
            f"{found.delivered / found.due:.2%}",
            f"{found.cost_us:.0f}",
            f"{found.cost_us / floor_us:.2f}",
            f"{found.cpu_s / found.wall_s:.0%}",
            f"{turns_s[int(len(turns_s) * 0.99)] * 1e3:.1f} ms",
        )
    Console().print(table)
    return int(any(ways[way].delivered < DELIVERED * ways[way].due for way in ("guard", "signed")))


if __name__ == "__main__":
    sys.exit(main())
