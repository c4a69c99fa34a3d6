"""Waydrop's part of a supervised drop in a simulated flight: the machine that decides in service, without a link."""

from __future__ import annotations

from collections.abc import Callable

from app.domain.drop.supervised import step
from app.domain.drop.supervised_inputs import DropObservation, DropTerms, ReleaseAck, Resume, SendRelease
from app.domain.drop.supervised_state import DropMachine
from app.domain.geo import distance_m
from app.domain.items import Gripper, Winch
from app.domain.mission import CompiledDrop, Mission
from app.domain.plan import Plan
from app.domain.vehicle.commands import CommandAck
from app.domain.vehicle.state import FlightMode, LandedState
from app.simulator.dialect import Message
from app.simulator.vehicle import Vehicle
from app.simulator.wire import Cmd, Mode

DEFAULT_MAX_OFFSET_M = 3.0


class SupervisedPilot:
    """Looks at the vehicle and carries out what the drops' machines order. `command` sends a COMMAND_LONG."""

    def __init__(self, plan: Plan, mission: Mission, vehicle: Vehicle, command: Callable[..., None]) -> None:
        offsets = {item.id: item.max_offset_m for item in plan.items if isinstance(item, Gripper | Winch)}
        self._vehicle = vehicle
        self._command = command
        self._current: int | None = None
        self._drops = [drop for drop in mission.drops if drop.supervised]
        self._machines = [
            DropMachine(DropTerms.of(drop, offsets[drop.plan_item_id] or DEFAULT_MAX_OFFSET_M)) for drop in self._drops
        ]

    def receive(self, message: Message, now_s: float) -> None:
        """From the vehicle: the current item is known from the link, once a second, as in service."""
        if message.get_type() == "MISSION_CURRENT":
            self._current = int(message.seq)
        elif message.get_type() == "COMMAND_ACK" and message.command in (Cmd.DO_GRIPPER, Cmd.DO_WINCH):
            ack = CommandAck(int(message.command), int(message.result), int(message.progress))
            for index, machine in enumerate(self._machines):
                if machine.in_flight is not None:
                    self._take(index, ReleaseAck(now_s, machine.in_flight, ack))

    def look(self, now_s: float) -> None:
        """One look at all drops that are not over."""
        for index, drop in enumerate(self._drops):
            if not self._machines[index].is_over:
                self._take(index, self._observation(drop, now_s))

    def note_orders(self, ordered_s: dict[str, float], at_s: float) -> None:
        """When each release was first ordered."""
        for drop, machine in zip(self._drops, self._machines, strict=True):
            if machine.attempts:
                ordered_s.setdefault(drop.plan_item_id, at_s)

    def _take(self, index: int, heard: DropObservation | ReleaseAck) -> None:
        self._machines[index], effects = step(self._machines[index], heard)
        for effect in effects:
            if isinstance(effect, SendRelease):
                drop = self._drops[index]
                self._command(int(drop.command), *drop.params)
            elif isinstance(effect, Resume):
                self._command(Cmd.DO_SET_MISSION_CURRENT, float(effect.seq))

    def _observation(self, drop: CompiledDrop, now_s: float) -> DropObservation:
        status, body = self._vehicle.state.status, self._vehicle.state.body
        place = self._vehicle.spec.frame.to_global(body.north_m, body.east_m)
        return DropObservation(
            now_s=now_s,
            connected=True,
            mode=FlightMode.MISSION if status.mode is Mode.MISSION else FlightMode.OTHER,
            armed=status.armed,
            in_failsafe=False,
            landed=LandedState.ON_GROUND if status.landed else LandedState.IN_AIR,
            mission_seq=self._current,
            boot_s=self._vehicle.clock.now_s,
            clock_rate=1.0,
            offset_m=distance_m(*place, drop.latitude_deg, drop.longitude_deg),
            ground_speed_m_s=body.ground_speed_m_s,
            position_age_s=0.0,
            height_error_m=self._height_error_m(drop),
        )

    def _height_error_m(self, drop: CompiledDrop) -> float | None:
        up_m, home = self._vehicle.state.body.up_m, self._vehicle.state.status.home
        if drop.relative_altitude_m is not None and home is not None:
            return abs(up_m - home.up_m - drop.relative_altitude_m)
        if drop.absolute_altitude_m is not None:
            return abs(up_m + self._vehicle.spec.frame.altitude_m - drop.absolute_altitude_m)
        return None
