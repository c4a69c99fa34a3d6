"""An embedded mission ends the same at 1x and at 50x: release, items, landing. Flown by the loop of the fleet."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field

import pytest

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.fleet import Fleet
from app.simulator.options import Options, VehicleOptions
from app.simulator.vehicle import Vehicle
from app.simulator.wire import Cmd, Mode
from tests.support.simulated_vehicle import RELEASE, RETURN, Plan, do, takeoff, waypoint

START_S = 6.0
DEADLINE_S = 60.0
MISSIONS: dict[str, Sequence[Plan]] = {
    "quad": (takeoff(15), waypoint(40, 0, 15, hold_s=3, radius_m=1), RELEASE, waypoint(40, 20, 15), RETURN),
    "plane": (takeoff(30, 120), waypoint(300, 0, 40), RELEASE, waypoint(500, 150, 40), waypoint(0, 0, 40)),
    "vtol": (takeoff(20), waypoint(50, 0, 20, hold_s=3, radius_m=2), RELEASE, RETURN),
    "rover": (waypoint(15, 0, 0), do(Cmd.NAV_DELAY, 3), RELEASE, waypoint(15, 10, 0)),
}


@dataclass
class Outcome:
    """What is compared."""

    items: list[int] = field(default_factory=list)
    """Reached, as told on the wire."""
    release: tuple[float, ...] = ()
    """North, east, up, ground speed, and the vehicle's time."""
    texts: list[str] = field(default_factory=list)
    end: tuple[float, ...] = ()


class Pilot:
    """Uploads, starts, and notes what happens, looking at every step. Stands in for the vehicle's radio link, too."""

    def __init__(self, vehicle: Vehicle, plans: Sequence[Plan]) -> None:
        self.outcome = Outcome()
        self.gcs_heard_s: float | None = None
        self.is_over = False
        self._vehicle = vehicle
        self._plans = plans
        self._poll = vehicle.poll
        self._started = False
        vehicle.radio.channels.append(self)
        vehicle.poll = self.poll  # type: ignore[method-assign]
        self._say(mavlink.MAVLink_mission_count_message(vehicle.system_id, 1, len(plans), 0, 0))

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """From the vehicle."""
        match message.get_type():
            case "MISSION_REQUEST_INT":
                self._say(self._item(message.seq))
            case "MISSION_ITEM_REACHED":
                if self.outcome.items[-1:] != [message.seq]:
                    self.outcome.items.append(message.seq)
            case "STATUSTEXT":
                self.outcome.texts.append(message.text.rstrip("\t"))

    def poll(self) -> None:
        """After each step of the vehicle."""
        self._poll()
        vehicle, body = self._vehicle, self._vehicle.state.body
        now_s = vehicle.clock.now_s
        if round(now_s / VehicleClock.STEP_S) % 50 == 0:
            self._say(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        if not self._started and now_s >= START_S:
            self._started = True
            self._command(Cmd.COMPONENT_ARM_DISARM, 1)
            self._command(Cmd.DO_SET_MODE, 1, Mode.MISSION >> 16 & 0xFF, Mode.MISSION >> 24)
        place = (body.north_m, body.east_m, body.up_m, body.ground_speed_m_s, now_s)
        if self._started and vehicle.state.gripper.output_released and not self.outcome.release:
            self.outcome.release = place
        if self.outcome.release and not self.is_over and vehicle.mission.result.finished:
            self.is_over = not vehicle.state.status.armed or vehicle.state.status.mode is Mode.LOITER
            self.outcome.end = place if self.is_over else ()

    def _command(self, command: int, *params: float) -> None:
        p = [*params, *(0.0,) * (7 - len(params))]
        self._say(mavlink.MAVLink_command_long_message(self._vehicle.system_id, 1, command, 0, *p))

    def _item(self, seq: int) -> Message:
        plan, x, y, frame = self._plans[seq], 0, 0, 2
        if plan.north_m is not None:
            latitude, longitude = self._vehicle.spec.frame.to_global(plan.north_m, plan.east_m)
            x, y, frame = round(latitude * 1e7), round(longitude * 1e7), 6
        return mavlink.MAVLink_mission_item_int_message(
            self._vehicle.system_id, 1, seq, frame, plan.command, int(seq == 0), 1, *plan.params, x, y, plan.up_m, 0
        )

    def _say(self, message: Message) -> None:
        packed = message.pack(mavlink.MAVLink(None, srcSystem=245, srcComponent=190))
        self._vehicle.receive(self, mavlink.MAVLink(None).decode(bytearray(packed)))


def fleet_of(speed: float) -> tuple[Fleet, list[Pilot]]:
    entries = tuple(VehicleOptions(name, number) for number, name in enumerate(MISSIONS, start=1))
    fleet = Fleet(Options(fleet=entries, speed=speed, params=(("MIS_TKO_LAND_REQ", 0),)))
    return fleet, [Pilot(v, MISSIONS[v.spec.airframe.name]) for v in fleet.vehicles]


def at_real_time() -> list[Outcome]:
    """As at 1x, one step after the other, without waiting for the wall clock."""
    fleet, pilots = fleet_of(1.0)
    for vehicle, pilot in zip(fleet.vehicles, pilots, strict=True):
        while not pilot.is_over:
            vehicle.step()
            vehicle.poll()
            assert vehicle.clock.now_s < 300.0, f"{vehicle.spec.airframe.name}: {pilot.outcome}"
    return [pilot.outcome for pilot in pilots]


async def test_embedded_missions_have_the_same_outcome_at_fifty_times_real_time() -> None:
    expected = at_real_time()
    fleet, pilots = fleet_of(50.0)
    running = asyncio.create_task(fleet.run())
    async with asyncio.timeout(DEADLINE_S):
        while not all(pilot.is_over for pilot in pilots):
            await asyncio.sleep(0.01)
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    for name, pilot, wanted in zip(MISSIONS, pilots, expected, strict=True):
        assert len(wanted.items) >= 3, name
        assert pilot.outcome.items == wanted.items, name
        assert pilot.outcome.texts == wanted.texts, name
        assert pilot.outcome.release == pytest.approx(wanted.release, abs=0.01), name
        assert pilot.outcome.end == pytest.approx(wanted.end, abs=0.01), name
