"""The same seed, fleet, parameters and inputs give the same bytes at the same times, whatever the link does to them."""

from __future__ import annotations

import asyncio
import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.faults import LinkFaults
from app.simulator.fleet import build_channel, build_vehicle
from app.simulator.options import Options, VehicleOptions

FLEET = (VehicleOptions("quad", 1), VehicleOptions("plane", 2), VehicleOptions("rover", 9, winch=True))
GROUND = ("127.0.0.1", 14540)
BAD_LINK = LinkFaults(loss=0.1, delay_s=0.05, jitter_s=0.2, duplicate=0.05, reorder=0.05)
SECONDS = 10.0
Datagram = tuple[float, int, bytes]


@dataclass
class SimulatedAir:
    """A socket and an event loop in simulated time."""

    now_s: float = 0.0
    arrived: list[Datagram] = field(default_factory=list)
    """Wall time, vehicle, bytes: what comes out at the ground."""
    _waiting: list[tuple[float, int, Callable[[], None]]] = field(default_factory=list)
    _count: int = 0

    def transport(self, index: int) -> asyncio.DatagramTransport:
        return _Socket(self, index)

    def later(self, wait_s: float, deliver: Callable[[], None]) -> None:
        self._count += 1
        heapq.heappush(self._waiting, (self.now_s + wait_s, self._count, deliver))

    def until(self, end_s: float) -> None:
        while self._waiting and self._waiting[0][0] <= end_s:
            self.now_s, _, deliver = heapq.heappop(self._waiting)
            deliver()
        self.now_s = end_s


class _Socket(asyncio.DatagramTransport):
    def __init__(self, air: SimulatedAir, index: int) -> None:
        super().__init__()
        self._air = air
        self._index = index

    def sendto(self, data: Any, addr: Any = None) -> None:
        self._air.arrived.append((self._air.now_s, self._index, bytes(data)))


def on_the_wire(seed: int, faults: LinkFaults, *, extra_input_s: float | None = None) -> list[Datagram]:
    """Every datagram that the ground gets from a fleet of which each vehicle is armed and takes off."""
    air = SimulatedAir()
    options = Options(fleet=FLEET, seed=seed, params=(("COM_DISARM_PRFLT", 60.0),))
    vehicles = [build_vehicle(options, index, entry, lambda: air.now_s) for index, entry in enumerate(FLEET)]
    channels = []
    for index, vehicle in enumerate(vehicles):
        for name, value in ((name, getattr(faults, name)) for name in LinkFaults.__slots__):
            setattr(vehicle.faults.link, name, value)
        channel = build_channel(options, vehicle, GROUND, str(index), lambda: air.now_s, air.later)
        channel.connection_made(air.transport(index))
        channels.append(channel)
    packer = mavlink.MAVLink(None, srcSystem=245, srcComponent=190)
    for step in range(round(SECONDS / VehicleClock.STEP_S)):
        for vehicle, channel in zip(vehicles, channels, strict=True):
            vehicle.step()
            vehicle.poll()
            for message in ground_says(step, vehicle.system_id):
                channel.datagram_received(bytes(message.pack(packer)), GROUND)
        air.until((step + 1) * VehicleClock.STEP_S)
        if extra_input_s is not None and abs(air.now_s - extra_input_s) < VehicleClock.STEP_S / 2:
            ping = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
            channels[0].datagram_received(bytes(ping.pack(packer)), GROUND)
    return air.arrived


def ground_says(step: int, system_id: int) -> list[Message]:
    """A heartbeat a second; then parameters, arming, take-off."""
    said: list[Message] = []
    if step % 50 == 0:
        said.append(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    if step == 100:
        said.append(mavlink.MAVLink_param_request_list_message(system_id, 1))
    if step in (300, 310, 320):
        said.append(mavlink.MAVLink_command_long_message(system_id, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
    if step in (350, 360, 370):
        said.append(mavlink.MAVLink_command_long_message(system_id, 1, 176, 0, 1, 4, 2, 0, 0, 0, 0))
    return said


def test_the_same_seed_gives_the_same_bytes_at_the_same_times() -> None:
    first = on_the_wire(7, LinkFaults())
    assert len({data[7] for _, _, data in first}) > 10, "many kinds of message"
    assert on_the_wire(7, LinkFaults()) == first


def test_so_it_does_over_a_link_that_loses_delays_doubles_and_reorders() -> None:
    first = on_the_wire(7, BAD_LINK)
    assert len({round(time_s / VehicleClock.STEP_S, 3) % 1 for time_s, _, _ in first}) > 100, "jitter shows"
    assert on_the_wire(7, BAD_LINK) == first


def test_another_seed_gives_other_losses_and_delays() -> None:
    assert on_the_wire(8, BAD_LINK) != on_the_wire(7, BAD_LINK)


def test_a_link_without_faults_does_not_depend_on_the_seed_but_for_the_uids() -> None:
    """Nothing else is random: no noise is added to what the vehicles measure."""
    autopilot_version = 148

    def without_version(seed: int) -> list[Datagram]:
        return [one for one in on_the_wire(seed, LinkFaults()) if one[2][7] != autopilot_version]

    assert without_version(8) == without_version(7)


def test_what_the_ground_sends_changes_no_loss_on_the_way_down() -> None:
    """Each direction has its own chances: a heartbeat more does not shift those of all later telemetry."""
    assert on_the_wire(7, BAD_LINK, extra_input_s=8.0) == on_the_wire(7, BAD_LINK)
