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
    spec = VehicleSpec(airframe, entry.system_id, profile, frame, params, options.seed, options.speed, salt=str(index))
    return Vehicle(spec, wall)


class Fleet:
    """Builds the vehicles of `options`, opens their sockets, and runs them until `run` is cancelled."""

    def __init__(self, options: Options, wall: Callable[[], float] = time.monotonic) -> None:
        self.options = options
        self._wall = wall
        self.vehicles = [build_vehicle(options, index, entry, wall) for index, entry in enumerate(options.fleet)]
        self._channels: list[Channel] = []

    async def open(self) -> None:
        """Bind every vehicle's socket. Raises OSError when a local port is taken."""
        loop = asyncio.get_running_loop()
        for index, vehicle in enumerate(self.vehicles):
            remote = (LOOPBACK, self.options.port + (0 if self.options.shared_port else index))
            local_port = self.options.local_port + index if self.options.local_port else 0
            rng = random.Random(f"{self.options.seed} {index}")
            channel = Channel(remote, vehicle.faults.link, rng, vehicle.receive, self._wall)
            await loop.create_datagram_endpoint(partial(_same, channel), local_addr=(LOOPBACK, local_port))
            vehicle.radio.channels.append(channel)
            self._channels.append(channel)

    def addresses(self) -> list[tuple[str, str]]:
        """Local and remote address of each vehicle, as text."""
        return [(channel.local_address, f"{channel.remote[0]}:{channel.remote[1]}") for channel in self._channels]

    def close(self) -> None:
        """Close the sockets."""
        for channel in self._channels:
            channel.close()

    async def run(self) -> None:
        """Drive the vehicles in step with the wall clock, times the speed factor."""
        step_s = VehicleClock.STEP_S / self.options.speed
        due_s = self._wall()
        while True:
            now_s = self._wall()
            due_s = max(due_s, now_s - MAX_BEHIND_S)
            while due_s <= now_s:
                for vehicle in self.vehicles:
                    vehicle.step()
                due_s += step_s
            for vehicle in self.vehicles:
                vehicle.poll()
            await asyncio.sleep(TICK_S)


def _same(channel: Channel) -> Channel:
    """Protocol factory for asyncio."""
    return channel
