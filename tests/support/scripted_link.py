"""A vehicle whose every answer the test decides."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from dataclasses import replace

from app.domain.autopilot.declared import default_facts
from app.domain.errors import (
    LinkError,
    LinkTimeoutError,
    VehicleQuarantinedError,
    VehicleRefusedError,
    VehicleTakenError,
    WaydropError,
)
from app.domain.flight.modes import disarmed_meanwhile
from app.domain.mission import MavCmd, MavFrame, Mission, MissionItem, MissionType
from app.domain.offboard.messages import SetpointMessage
from app.domain.ports.vehicle_link import Unsubscribe, UploadProgress, VehicleIdentity
from app.domain.vehicle.commands import CommandAck, CommandRequest, MavResult
from app.domain.vehicle.facts import ClockRateSet, LinkFact, QuarantineEnded, StateChanged
from app.domain.vehicle.state import (
    FirmwareVersion,
    FlightMode,
    LandedState,
    MissionState,
    VehicleProfile,
    VehicleState,
    VehicleType,
)
from app.services.runs import RunSettings
from app.vehicles.mission_wire import mission_checksum, to_wire
from tests.support.fake_links import MEASURED_CLOCK

FAST = RunSettings(armable_s=0.05, arm_again_s=0.01, poll_every_s=0.005, lost_after_s=60.0, ack_s=0.2, gripper_s=0.5)
"""A link that is away for a moment is not lost, however long the moment is on a busy machine."""


class ScriptedVehicle:
    """Implements VehicleLink. It stays where the test puts it. An upload is named by `upload_id`, or by its checksum if
    it `names_as_px4`.
    """

    upload_id: int | None = 77
    names_as_px4 = False

    def __init__(self, vehicle_type: VehicleType = VehicleType.MULTICOPTER) -> None:
        self.identity = VehicleIdentity(1, "udpin://scripted", vehicle_type, FirmwareVersion(1, 18, 0), "uid-1")
        self.facts = default_facts(vehicle_type)
        self.truth = VehicleState(
            connected=True,
            mode=FlightMode.HOLD,
            armed=False,
            landed=LandedState.ON_GROUND,
            latitude_deg=47.397742,
            longitude_deg=8.545594,
            velocity_north_m_s=0.0,
            velocity_east_m_s=0.0,
            mission_state=MissionState.NOT_STARTED,
            mission_seq=0,
            clock=MEASURED_CLOCK,
        )
        self.listeners: list[Callable[[LinkFact], None]] = []
        self.looks = 0
        self.heartbeat_age_s = 0.1
        self.mission_age_s = 0.0
        self.boot_ahead_s = 0.0
        self.station_age_s: float | None = None
        self.sent: list[str] = []
        self.releases: list[CommandRequest] = []
        self.setpoints: list[SetpointMessage] = []
        self.setpoint_error: LinkError | None = None
        self.parameters: dict[str, float | int] = {"COM_OBL_RC_ACT": 5, "COM_OF_LOSS_T": 1.0, "COM_RC_IN_MODE": 4}
        self.answers: list[list[MavResult] | LinkError] = []
        self.orders: list[CommandRequest] = []
        self.order_answers: list[MavResult | WaydropError] = []
        self.home_answers: list[MavResult | LinkError] = []
        self.on_order: Callable[[], None] = lambda: None
        self.on_board: tuple[MissionItem, ...] = ()
        self.upload_error: LinkError | None = None
        self.infeasible = 0
        self.lost_ack: LinkError | None = None
        self.waits_at_gate = False
        self.upload_closed = False
        self.arm_refusals = 0
        self.arm_errors: list[WaydropError] = []
        self.start_error: LinkError | None = None
        self.hold_error: WaydropError | None = None
        self.disarm_error: LinkError | None = None
        self.says_armed = True
        self.start_gate, self.hold_gate, self.return_gate = asyncio.Event(), asyncio.Event(), asyncio.Event()
        self.order_gate, self.upload_gate, self.disarm_gate = asyncio.Event(), asyncio.Event(), asyncio.Event()
        mode_gates = (self.start_gate, self.hold_gate, self.return_gate)
        for gate in (*mode_gates, self.order_gate, self.upload_gate, self.disarm_gate):
            gate.set()

    def put(self, *facts: LinkFact, **changes: object) -> None:
        """Change what is true, and tell."""
        self.truth = replace(self.truth, **changes)  # type: ignore[arg-type]
        for listener in tuple(self.listeners):
            for fact in facts or (StateChanged(),):
                listener(fact)

    def state(self) -> VehicleState:
        self.looks += 1
        now_s = time.monotonic()
        return replace(
            self.truth,
            boot_time_s=now_s + self.boot_ahead_s,
            position_age_s=0.01,
            heartbeat_age_s=self.heartbeat_age_s,
            mission_age_s=None if self.truth.mission_seq is None else self.mission_age_s,
        )

    def subscribe(self, listener: Callable[[LinkFact], None]) -> Unsubscribe:
        self.listeners.append(listener)
        return lambda: self.listeners.remove(listener) if listener in self.listeners else None

    def end_quarantine(self, actor: str) -> None:
        self.put(QuarantineEnded(actor))

    def ground_station_age_s(self, system_id: int) -> float | None:
        return self.station_age_s

    def set_clock_rate(self, rate: float) -> None:
        self.truth = replace(self.truth, clock=self.truth.clock.set_to(rate))
        for listener in tuple(self.listeners):
            listener(ClockRateSet(rate))

    async def read_facts(self, *, fresh: bool = False) -> VehicleProfile:
        return self.facts

    async def upload(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        try:
            yield UploadProgress(MissionType.MISSION, 0, len(mission.items), 1)
            self.waits_at_gate = True
            await self.upload_gate.wait()
            self.waits_at_gate = False
            if self.upload_error is not None:
                raise self.upload_error
            self.on_board = mission.items
            rally_id = self.rally_points_id_of(mission) if mission.rally else None
            fence_id = self.fence_id_of(mission) if mission.fence else None
            total = len(mission.items)
            named = self.mission_id_of(mission) if self.names_as_px4 else self.upload_id
            self.truth = replace(self.truth, mission_id=named, fence_id=fence_id, rally_points_id=rally_id)
            yield UploadProgress(MissionType.MISSION, total, total, 1, "mission_id", named)
        finally:
            self.upload_closed = True

    def mission_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.items))

    def fence_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.fence))

    def rally_points_id_of(self, mission: Mission) -> int:
        return mission_checksum(to_wire(mission.rally))

    async def replace_mission(self, mission: Mission) -> AsyncGenerator[UploadProgress, None]:
        """`upload_gate` holds it back before its last item; `lost_ack`: it arrives, and nobody hears of it."""
        total, named = len(mission.items), self.mission_id_of(mission)
        try:
            yield UploadProgress(MissionType.MISSION, 0, total, 1)
            self.waits_at_gate = True
            await self.upload_gate.wait()
            self.waits_at_gate = False
            if self.upload_error is not None:
                raise self.upload_error
            self.on_board = mission.items
            if self.lost_ack is not None:
                raise self.lost_ack
            self.put(mission_id=named, mission_seq=0)
            yield UploadProgress(MissionType.MISSION, total, total, 1, "mission_id", named)
        finally:
            self.upload_closed = True

    async def download(self, mission_type: MissionType) -> tuple[MissionItem, ...]:
        return self.on_board

    async def wait_mission_ready(self, *, mission_id: int | None, rerun: bool, timeout_s: float) -> None:
        self.sent.append("wait_ready")
        if self.infeasible > 0:
            self.infeasible -= 1
            self.put(mode=FlightMode.HOLD, mission_state=MissionState.NO_MISSION)
            raise VehicleRefusedError("the mission is infeasible: Geofence violation", texts=["Geofence violation"])

    async def set_current(self, seq: int) -> None:
        self.sent.append(f"set_current {seq}")
        self.put(mission_seq=seq)

    async def arm(self, leaves: Callable[[], None] = lambda: None) -> None:
        self.sent.append("arm")
        error = self.arm_errors.pop(0) if self.arm_errors else None
        if not isinstance(error, VehicleTakenError | VehicleQuarantinedError):  # of which nothing is sent
            leaves()
        if error is not None:
            raise error
        if self.arm_refusals:
            self.arm_refusals -= 1
            raise VehicleRefusedError("arming denied; Preflight Fail: no GNSS", texts=["Preflight Fail: no GNSS"])
        self.put(armed=self.says_armed)

    async def wait_armed(self) -> None:
        if not self.says_armed:
            raise LinkTimeoutError("no HEARTBEAT")
        if not self.truth.armed:
            raise disarmed_meanwhile(self.truth.mode)

    async def disarm(self) -> None:
        self.sent.append("disarm")
        await self.disarm_gate.wait()
        if self.disarm_error is not None:
            raise self.disarm_error
        self.put(armed=False)

    async def start_mission(self) -> None:
        self.sent.append("start")
        await self.start_gate.wait()
        if self.start_error is not None:
            raise self.start_error
        self.put(mode=FlightMode.MISSION, mission_state=MissionState.ACTIVE)

    async def hold(self) -> None:
        self.sent.append("hold")
        await self.hold_gate.wait()
        self.put(mode=FlightMode.HOLD)

    async def hold_disarmed(self) -> None:
        self.sent.append("hold_disarmed")
        if self.hold_error is not None:
            raise self.hold_error
        self.put(mode=FlightMode.HOLD)

    async def return_to_launch(self) -> None:
        self.sent.append("return")
        if self.truth.mode is FlightMode.OFFBOARD:
            self.put(mode=FlightMode.HOLD)
            await self.return_gate.wait()
        self.put(mode=FlightMode.RETURN)

    async def land(self) -> None:
        self.sent.append("land")
        self.put(mode=FlightMode.LAND)

    async def enter_offboard(self) -> None:
        self.sent.append("offboard")
        self.put(mode=FlightMode.OFFBOARD)

    def send_setpoint(self, message: SetpointMessage) -> None:
        if self.setpoint_error is not None:
            raise self.setpoint_error
        self.setpoints.append(message)

    async def read_parameters(self, names: Sequence[str]) -> Mapping[str, float | int]:
        return {name: value for name, value in self.parameters.items() if name in names}

    async def command(self, request: CommandRequest) -> AsyncGenerator[CommandAck, None]:
        if request.command is MavCmd.DO_GRIPPER and request.params[1] == 0.0:
            self.releases.append(request)
            answer = self.answers.pop(0) if self.answers else [MavResult.IN_PROGRESS, MavResult.ACCEPTED]
            if isinstance(answer, LinkError):
                raise answer
            for result in answer:
                yield CommandAck(request.command, int(result))
            return
        if request.command is MavCmd.DO_SET_HOME:
            self.sent.append(f"home {request.params[0]:g}")
            told = self.home_answers.pop(0) if self.home_answers else MavResult.ACCEPTED
            if isinstance(told, LinkError):
                raise told
            yield CommandAck(request.command, int(told))
            return
        if request.command in (MavCmd.DO_REPOSITION, MavCmd.DO_ORBIT):
            self.orders.append(request)
            self.on_order()
            await self.order_gate.wait()
            answered = self.order_answers.pop(0) if self.order_answers else MavResult.ACCEPTED
            if isinstance(answered, WaydropError):
                raise answered
            yield CommandAck(request.command, int(answered))
            return
        self.sent.append(f"{request.command.name} {request.params[1]:g}")
        yield CommandAck(request.command, int(MavResult.ACCEPTED))

    async def fly_to_hold(self, latitude_deg: float, longitude_deg: float, seq: int) -> None:
        """Approach a hold item slowly enough to be seen outside its radius, then stop in it, at its altitude."""
        is_absolute = self.on_board[seq].frame is MavFrame.GLOBAL_INT
        self.put(**{"absolute_altitude_m" if is_absolute else "relative_altitude_m": self.on_board[seq].z})
        self.put(
            mission_seq=seq, landed=LandedState.IN_AIR, latitude_deg=latitude_deg - 0.0001, longitude_deg=longitude_deg
        )
        await asyncio.sleep(FAST.poll_every_s * 4)
        self.put(latitude_deg=latitude_deg)

    def touch_down(self, *, complete: bool, last_seq: int) -> None:
        """Land and disarm."""
        if complete:
            self.put(mission_state=MissionState.COMPLETE, mission_seq=last_seq, mode=FlightMode.RETURN)
        self.put(armed=False, landed=LandedState.ON_GROUND)
