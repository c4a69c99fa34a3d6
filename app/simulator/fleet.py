"""All vehicles of one process: their sockets, and the clock that drives them."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import Callable
from functools import partial

from app.simulator.airframe import AIRFRAMES
from app.simulator.channel import Channel
from app.simulator.clock import VehicleClock
from app.simulator.firmware import PROFILES
from app.simulator.geo import LocalFrame
from app.simulator.options import Options, VehicleOptions
from app.simulator.params import Params, Value
from app.simulator.vehicle import Vehicle, VehicleSpec
from app.simulator.wire import GRIPPER_FUNCTION

LOOPBACK = "127.0.0.1"
TICK_S = 0.01
MAX_BEHIND_S = 0.25
"""When the machine cannot keep up, vehicle time runs slower instead of catching up in one jump."""
SPACING_M = 5.0
DUPLICATE_OFFSET = 6
TIMES_SCALED_BY_SPEED = ("COM_DL_LOSS_T", "COM_OF_LOSS_T")
"""PX4's SITL start-up multiplies these by the speed factor, so that they stay wall time."""


def build_vehicle(options: Options, index: int, entry: VehicleOptions, wall: Callable[[], float]) -> Vehicle:
    """Vehicle `index` of the fleet, without a socket."""
    airframe, profile = AIRFRAMES[entry.airframe], PROFILES[options.firmware]
    own: dict[str, Value] = {
        "MAV_SYS_ID": entry.system_id,
        "MAV_TYPE": airframe.mav_type,
        f"PWM_MAIN_FUNC{airframe.gripper_servo}": GRIPPER_FUNCTION,
    }
    params = Params(airframe.params, profile.params, own, dict(options.params))
    for name in TIMES_SCALED_BY_SPEED:
        params.set(name, params[name] * options.speed)
    first = LocalFrame(*options.home)
    latitude, longitude = first.to_global(0.0, SPACING_M * index)
    frame = LocalFrame(latitude, longitude, options.home[2])
    spec = VehicleSpec(
        airframe=airframe,
        system_id=entry.system_id,
        profile=profile,
        frame=frame,
        params=params,
        seed=options.seed,
        speed=options.speed,
        salt=str(index),
        winch=entry.winch,
    )
    return Vehicle(spec, wall)


class Fleet:
    """Builds the vehicles of `options`, opens their sockets, and runs them until `run` is cancelled."""

    def __init__(self, options: Options, wall: Callable[[], float] = time.monotonic) -> None:
        self.options = options
        self._wall = wall
        self.vehicles = [build_vehicle(options, index, entry, wall) for index, entry in enumerate(options.fleet)]
        self._channels: list[Channel] = []
        """The link of each vehicle."""
        self._extra: list[Channel] = []
        self._duplicates: dict[int, list[Vehicle]] = {}

    async def open(self) -> None:
        """Bind every vehicle's socket. Raises OSError when a local port is taken."""
        for index, vehicle in enumerate(self.vehicles):
            remote = (LOOPBACK, self.options.port + (0 if self.options.shared_port else index))
            local_port = self.options.local_port + index if self.options.local_port else 0
            self._channels.append(await self._link(vehicle, remote, local_port, f"{index}"))
            if self.options.gcs_port is not None:
                self._extra.append(await self._link(vehicle, (LOOPBACK, self.options.gcs_port), 0, f"{index} gcs"))

    async def _link(self, vehicle: Vehicle, remote: tuple[str, int], local_port: int, name: str) -> Channel:
        rng = random.Random(f"{self.options.seed} {name}")
        channel = Channel(remote, vehicle.faults.link, rng, vehicle.receive, self._wall)
        loop = asyncio.get_running_loop()
        await loop.create_datagram_endpoint(partial(_same, channel), local_addr=(LOOPBACK, local_port))
        vehicle.radio.channels.append(channel)
        return channel

    async def add_duplicate(self, original: Vehicle) -> None:
        """A second vehicle with the same system id appears on the same ground port, 30 m away."""
        index = self.vehicles.index(original)
        entry = VehicleOptions(original.spec.airframe.name, original.system_id)
        twin = build_vehicle(self.options, index + DUPLICATE_OFFSET, entry, self._wall)
        remote = (LOOPBACK, self.options.port + (0 if self.options.shared_port else index))
        self._extra.append(await self._link(twin, remote, 0, f"{index} duplicate"))
        self._duplicates.setdefault(original.system_id, []).append(twin)

    def duplicates_of(self, system_id: int) -> list[Vehicle]:
        """The vehicles that came later with this system id."""
        return list(self._duplicates.get(system_id, ()))

    def remove_duplicates(self, original: Vehicle) -> None:
        """They fall silent for good."""
        for twin in self._duplicates.pop(original.system_id, []):
            twin.radio.silent = True

    def addresses(self) -> list[tuple[str, str]]:
        """Local and remote address of each vehicle, as text."""
        return [(channel.local_address, f"{channel.remote[0]}:{channel.remote[1]}") for channel in self._channels]

    def close(self) -> None:
        """Close the sockets."""
        for channel in (*self._channels, *self._extra):
            channel.close()

    async def run(self) -> None:
        """Drive the vehicles in step with the wall clock, times the speed factor."""
        step_s = VehicleClock.STEP_S / self.options.speed
        due_s = self._wall()
        while True:
            now_s = self._wall()
            due_s = max(due_s, now_s - MAX_BEHIND_S)
            everybody = [*self.vehicles, *(twin for twins in self._duplicates.values() for twin in twins)]
            while due_s <= now_s:
                for vehicle in everybody:
                    vehicle.step()
                due_s += step_s
            for vehicle in everybody:
                vehicle.poll()
            await asyncio.sleep(TICK_S)


def _same(channel: Channel) -> Channel:
    """Protocol factory for asyncio."""
    return channel
