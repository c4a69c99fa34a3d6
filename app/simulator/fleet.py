"""All vehicles of one process: their sockets, and the clock that drives them."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

from app.simulator.airframe import AIRFRAMES
from app.simulator.channel import Channel, Later
from app.simulator.clock import VehicleClock
from app.simulator.firmware import PROFILES
from app.simulator.geo import LocalFrame
from app.simulator.options import MAX_LIVE_SPEED, Options, VehicleOptions
from app.simulator.pace import Pace
from app.simulator.params import Params, Value
from app.simulator.payload import function_params
from app.simulator.vehicle import Vehicle, VehicleSpec
from app.simulator.wire import GRIPPER_FUNCTION

# Parameters that are wall time in a simulation: the vehicle reads them in its own time, which runs faster.


SCALED_BY_SPEED: Final = ("COM_DL_LOSS_T", "COM_OF_LOSS_T")
"""PX4's SITL start-up multiplies these by the speed factor, so that they stay wall time."""
START_TIME: Final = "COM_DISARM_PRFLT"
"""PX4 does not: the time from arming to the take-off order. Above 4x it would be over before the order can come."""


class WallTimes:
    """Multiplies them by the clock's speed, now and at every change of it. One that a ground station has set counts
    from then on.
    """

    def __init__(self, params: Params, clock: VehicleClock) -> None:
        self._params = params
        self._clock = clock
        self._real = {name: float(params[name]) for name in (*SCALED_BY_SPEED, START_TIME)}
        self._last = {name: params[name] for name in self._real}
        self._factors = dict.fromkeys(self._real, 1.0)
        self._scale()
        clock.on_speed(lambda factor: self._scale())

    def _scale(self) -> None:
        for name in self._real:
            if self._params[name] != self._last[name]:
                self._real[name] = float(self._params[name]) / self._factors[name]
            self._factors[name] = _factor(name, self._clock.speed)
            self._params.set(name, self._real[name] * self._factors[name])
            self._last[name] = self._params[name]


def _factor(name: str, speed: float) -> float:
    return max(1.0, speed / MAX_LIVE_SPEED) if name == START_TIME else speed


LOOPBACK = "127.0.0.1"
BATCH_S = 0.02
"""After so much work in one go the sockets are looked at, also when more steps are due."""
LEAST_WAIT_S = 0.004
"""At high speeds several steps are taken together: waking up costs more than a step."""
SPACING_M = 15.0
"""Between neighbours: their marks on a map of the whole fleet do not overlap."""
ROW = 10
"""Vehicles beside each other, west to east; the next row stands north of it, so that a large fleet stays near home."""
DUPLICATE_OFFSET = 6


def build_vehicle(options: Options, index: int, entry: VehicleOptions, wall: Callable[[], float]) -> Vehicle:
    """Vehicle `index` of the fleet, without a socket."""
    airframe, profile = AIRFRAMES[entry.airframe], PROFILES[options.firmware]
    functions = airframe.functions
    if entry.external_gripper:
        functions = tuple(function for function in functions if function != GRIPPER_FUNCTION)
    outputs: dict[str, Value] = {**function_params(functions)}
    own: dict[str, Value] = {"MAV_SYS_ID": entry.system_id, "MAV_TYPE": airframe.mav_type}
    set_up = (*own, *(name for name, function in outputs.items() if function == GRIPPER_FUNCTION))
    params = Params(
        airframe.params,
        profile.params,
        {**own, **outputs},
        dict(options.params),
        absent=profile.absent,
        unread=airframe.unread,
        unsaved=("SYS_AUTOSTART", *set_up, *(name for name, _value in options.params)),
    )
    first = LocalFrame(*options.home)
    latitude, longitude = first.to_global(SPACING_M * (index // ROW), SPACING_M * (index % ROW))
    frame = LocalFrame(latitude, longitude, options.home[2])
    spec = VehicleSpec(
        entry=entry,
        airframe=airframe,
        profile=profile,
        frame=frame,
        params=params,
        seed=options.seed,
        speed=options.speed,
        rates=options.rates,
        salt=str(index),
    )
    vehicle = Vehicle(spec, wall)
    WallTimes(vehicle.params, vehicle.clock)
    return vehicle


def build_channel(
    options: Options,
    vehicle: Vehicle,
    remote: tuple[str, int],
    name: str,
    wall: Callable[[], float],
    later: Later | None = None,
) -> Channel:
    """A link of a vehicle, without a socket. `name` and the seed choose its losses and delays."""
    rng = random.Random(f"{options.seed} {name}")
    channel = Channel(remote, vehicle.faults.link, rng, vehicle.receive, wall, later, vehicle.signing.link())
    vehicle.radio.channels.append(channel)
    return channel


class Fleet:
    """Builds the vehicles of `options`, opens their sockets, and runs them until `run` is cancelled."""

    def __init__(self, options: Options, wall: Callable[[], float] = time.monotonic) -> None:
        self.options = options
        self._wall = wall
        self.pace = Pace(options.speed, wall)
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
        channel = build_channel(self.options, vehicle, remote, name, self._wall)
        loop = asyncio.get_running_loop()
        try:
            await loop.create_datagram_endpoint(partial(_same, channel), local_addr=(LOOPBACK, local_port))
        except OSError as error:
            raise OSError(error.errno, f"UDP {LOOPBACK}:{local_port}: {error.strerror}") from error
        return channel

    async def add_duplicate(self, original: Vehicle) -> None:
        """A second vehicle with the same system id appears on the same ground port, 30 m away."""
        index = self.vehicles.index(original)
        entry = VehicleOptions(original.spec.airframe.name, original.system_id)
        options = replace(self.options, speed=self.pace.speed)
        twin = build_vehicle(options, index + DUPLICATE_OFFSET, entry, self._wall)
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

    def everybody(self) -> list[Vehicle]:
        """The vehicles and their duplicates."""
        return [*self.vehicles, *(twin for twins in self._duplicates.values() for twin in twins)]

    def change_speed(self, speed: float) -> None:
        """All vehicles' time runs `speed` times as fast as the wall's from now on, and goes on from where it is."""
        self.pace.change(speed)
        for vehicle in self.everybody():
            vehicle.clock.change_speed(speed)

    def addresses(self) -> list[tuple[str, str]]:
        """Local and remote address of each vehicle, as text."""
        return [(channel.local_address, f"{channel.remote[0]}:{channel.remote[1]}") for channel in self._channels]

    def close(self) -> None:
        for channel in (*self._channels, *self._extra):
            channel.close()

    async def run(self) -> None:
        """Drive the vehicles in step with the wall clock, times the speed factor."""
        self.pace.begin()
        while True:
            everybody = self.everybody()
            look_up_s = self._wall() + BATCH_S
            while self.pace.take():
                for vehicle in everybody:
                    vehicle.step()
                    vehicle.poll()  # after each step: what is reported does not depend on the speed
                if self._wall() >= look_up_s:
                    break
            wait_s = self.pace.wait_s()
            await asyncio.sleep(max(wait_s, LEAST_WAIT_S) if wait_s > 0.0 else 0.0)


def _same(channel: Channel) -> Channel:
    """Protocol factory for asyncio."""
    return channel
