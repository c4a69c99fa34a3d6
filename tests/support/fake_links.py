"""Vehicles made of a few lines: they obey at once, and can be told to refuse."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from dataclasses import replace

from app.domain.errors import ConflictError, WaydropError
from app.domain.mission import Mission, MissionItem, MissionType
from app.domain.offboard.messages import SetpointMessage
from app.domain.ports.vehicle_link import Unsubscribe, UploadProgress, VehicleIdentity
from app.domain.vehicle.clock import VehicleClock
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult
from app.domain.vehicle.facts import (
    ClockRateSet,
    DuplicateSystem,
    LinkFact,
    MissionCurrent,
    QuarantineEnded,
    StateChanged,
)
from app.domain.vehicle.state import (
    FirmwareVersion,
    FlightMode,
    GlobalPosition,
    LandedState,
    MissionState,
    VehicleProfile,
    VehicleState,
    VehicleType,
)
from app.vehicles.mission_wire import mission_checksum, to_wire

HOME = GlobalPosition(47.397742, 8.545594, 488.0)

MEASURED_CLOCK = VehicleClock(((0.0, 0.0), (1.0, 1.0), (2.0, 2.0)))
"""A start or a change does not wait until it is measured."""


class FakeLink:
    """VehicleLink of a multicopter that stays where it is. `refusal` is raised by whatever is asked next."""

    def __init__(self, system_id: int) -> None:
        self.identity = VehicleIdentity(
            system_id,
            "udpin://127.0.0.1:18290",
            VehicleType.MULTICOPTER,
            FirmwareVersion(1, 17, 0),
            f"{system_id:024x}",
        )
        self._state = VehicleState(
            connected=True,
            mode=FlightMode.HOLD,
            armed=False,
            landed=LandedState.ON_GROUND,
            latitude_deg=HOME.latitude_deg,
            longitude_deg=HOME.longitude_deg,
            absolute_altitude_m=HOME.altitude_m,
            relative_altitude_m=0.0,
            velocity_north_m_s=0.0,
            velocity_east_m_s=0.0,
            velocity_down_m_s=0.0,
            heading_deg=0.0,
            position_age_s=0.0,
            heartbeat_age_s=0.0,
            battery_percent=90.0,
            home=HOME,
            home_ned_m=(0.0, 0.0, 0.0),
            clock=MEASURED_CLOCK,
        )
        self._listeners: list[Callable[[LinkFact], None]] = []
        self.is_quarantined = False
        self.setpoints: list[SetpointMessage] = []
        self.parameters: dict[str, float | int] = {"COM_OBL_RC_ACT": 5, "COM_OF_LOSS_T": 1.0, "COM_RC_IN_MODE": 4}
        self.facts: VehicleProfile | None = None
        self.refusal: WaydropError | None = None
        self.upload_refusal: WaydropError | None = None
        self.uploads = 0
        self.upload_gate = asyncio.Event()
        self.upload_gate.set()
        self.facts_gate = asyncio.Event()
        self.facts_gate.set()

    def state(self) -> VehicleState:
        return self._state

    def change(self, **changes: object) -> None:
        """Change the state and tell it."""
        self.move(**changes)
        self.emit(StateChanged())

    def move(self, **changes: object) -> None:
        """Change what is telemetry alone: nothing is told."""
        self._state = replace(self._state, **changes)  # type: ignore[arg-type]

    def emit(self, fact: LinkFact) -> None:
        """Say a fact to every listener."""
        if isinstance(fact, DuplicateSystem | QuarantineEnded):
            self.is_quarantined = isinstance(fact, DuplicateSystem)
        for listener in tuple(self._listeners):
            listener(fact)

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def end_quarantine(self, actor: str) -> None:
        if not self.is_quarantined:
            raise ConflictError("it is not quarantined")
        self.emit(QuarantineEnded(actor))

    def ground_station_age_s(self, system_id: int) -> float | None:
        return None

    def set_clock_rate(self, rate: float) -> None:
        self.move(clock=self._state.clock.set_to(rate))
        self.emit(ClockRateSet(rate))

    async def read_facts(self, *, fresh: bool = False) -> VehicleProfile:
        self._refuse()
        await self.facts_gate.wait()
        if self.facts is not None:
            return self.facts
        firmware, uid = self.identity.firmware, self.identity.uid
        return VehicleProfile(VehicleType.MULTICOPTER, firmware, uid, HOME, parameters_age_s=2.54)

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        if self.upload_refusal is not None:
            raise self.upload_refusal
        await self.upload_gate.wait()
        total = len(mission.items)
        rally_id = self.rally_points_id_of(mission) if mission.rally else None
        self.change(mission_total=total, mission_state=MissionState.NOT_STARTED, mission_seq=0, mission_id=7)
        self.move(fence_id=self.fence_id_of(mission) if mission.fence else None, rally_points_id=rally_id)
        yield UploadProgress(MissionType.MISSION, total, total, 1, verified_by="mission_id", mission_id=7)

    def mission_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.items))

    def fence_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.fence))

    def rally_points_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.rally))

    async def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        total, named = len(mission.items), self.mission_id_of(mission)
        yield UploadProgress(MissionType.MISSION, 0, total, 1)
        if self.upload_refusal is not None:
            raise self.upload_refusal
        self.uploads += 1
        await self.upload_gate.wait()
        self.change(mission_total=total, mission_seq=0, mission_id=named)
        yield UploadProgress(MissionType.MISSION, total, total, 1, verified_by="mission_id", mission_id=named)

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        return ()

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        self._refuse()

    async def set_current(self, seq: int) -> None:
        self.change(mission_seq=seq)
        self.emit(MissionCurrent(seq))

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        self._refuse()
        leaves()
        self.change(armed=True)

    async def wait_armed(self) -> None:
        """It is."""

    async def disarm(self) -> None:
        self.change(armed=False)

    async def start_mission(self) -> None:
        self._refuse()
        self.change(
            mode=FlightMode.MISSION,
            landed=LandedState.IN_AIR,
            relative_altitude_m=15.0,
            mission_state=MissionState.ACTIVE,
        )

    async def hold(self) -> None:
        self._switch(FlightMode.HOLD)

    async def hold_disarmed(self) -> None:
        self._switch(FlightMode.HOLD)

    async def return_to_launch(self) -> None:
        self._switch(FlightMode.RETURN)

    async def land(self) -> None:
        self._switch(FlightMode.LAND)

    async def enter_offboard(self) -> None:
        self._switch(FlightMode.OFFBOARD)

    def send_setpoint(self, message: SetpointMessage) -> None:
        self._refuse()
        self.setpoints.append(message)

    async def read_parameters(self, names: Sequence[str]) -> Mapping[str, float | int]:
        self._refuse()
        return self.parameters

    async def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        self._refuse()
        yield CommandAck(int(request.command), int(MavResult.ACCEPTED))

    def _switch(self, mode: FlightMode) -> None:
        self._refuse()
        self.change(mode=mode)

    def _refuse(self) -> None:
        if self.refusal is not None:
            raise self.refusal
