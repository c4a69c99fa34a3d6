"""Flies a plan on a simulated vehicle in this process, on a clock that nobody waits for, and notes when what happened.

What is noted is the truth of the vehicle at each of its steps (20 ms), not what a link shows of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from app.domain.mission import MavCmd, Mission, MissionItem
from app.domain.plan import Plan
from app.domain.plan.compiler import compile_plan
from app.domain.vehicle.state import FirmwareVersion, GlobalPosition, VehicleProfile
from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.fleet import build_vehicle
from app.simulator.options import DEFAULT_HOME, Options, VehicleOptions
from app.simulator.params import Value
from app.simulator.wire import Cmd, Mode
from bench.supervised_pilot import SupervisedPilot

READY_S = 6.0
LONGEST_FLIGHT_S = 1200.0
LOOK_STEPS = 5
"""Waydrop looks at a vehicle ten times a second."""
GROUND = (245, 190)


@dataclass(frozen=True, slots=True)
class Released:
    """Where the vehicle was as its gripper's output went to release, or as a winch item began."""

    at_s: float
    latitude_deg: float
    longitude_deg: float
    ground_speed_m_s: float


@dataclass(slots=True)
class FlownMission:
    """`item_ends` are (seq, seconds since the start) in order, one for each visit.

    `ordered_s` is, by supervised drop, when its release was first ordered. `ended_s`: landed, or holding at the last
    item; None if it did not end in time.
    """

    item_ends: list[tuple[int, float]] = field(default_factory=list)
    releases: list[Released] = field(default_factory=list)
    ordered_s: dict[str, float] = field(default_factory=dict)
    landed_s: float | None = None
    ended_s: float | None = None


class SimulatedFlight:
    """One vehicle, one mission. `facts` are the vehicle's own, as a link would read them."""

    def __init__(
        self,
        airframe: str,
        *,
        wind_m_s: tuple[float, float] = (0.0, 0.0),
        params: dict[str, Value] | None = None,
        firmware: str = "px4-main",
        winch: bool = False,
    ) -> None:
        self._now_s = 0.0
        options = Options(fleet=(), firmware=firmware, params=tuple((params or {}).items()))
        self.vehicle = build_vehicle(options, 0, VehicleOptions(airframe, 1, winch), lambda: self._now_s)
        self.vehicle.faults.wind_north_m_s, self.vehicle.faults.wind_east_m_s = wind_m_s
        self.vehicle.radio.channels.append(self)
        self.gcs_heard_s: float | None = None
        self._requested: list[Message] = []
        self._pilot: SupervisedPilot | None = None
        self._steps = 0
        self._fly(READY_S)

    def facts(self, plan: Plan) -> VehicleProfile:
        """What Waydrop would read from this vehicle."""
        version = self.vehicle.spec.profile.flight_sw_version
        return VehicleProfile(
            vehicle_type=plan.vehicle_type,
            firmware=FirmwareVersion(version >> 24, version >> 16 & 255, version >> 8 & 255),
            home=GlobalPosition(*DEFAULT_HOME),
            parameters={name: self.vehicle.params[name] for name in self.vehicle.params},
        )

    def fly(self, plan: Plan) -> FlownMission:
        """Upload, arm, start, and follow to the end. RuntimeError if the vehicle does not take it."""
        mission = compile_plan(plan, self.facts(plan))
        for number, items in enumerate((mission.items, mission.fence, mission.rally)):
            if items:
                self._upload(items, number)
        self._fly(1.0)
        self._pilot = SupervisedPilot(plan, mission, self.vehicle, self._command)
        self._command(Cmd.COMPONENT_ARM_DISARM, 1.0)
        self._command(Cmd.DO_SET_MODE, 1.0, float(Mode.MISSION >> 16 & 0xFF), float(Mode.MISSION >> 24))
        if self.vehicle.state.status.mode is not Mode.MISSION or not self.vehicle.state.status.armed:
            raise RuntimeError("the vehicle did not start")
        return self._follow(mission)

    # following ----------------------------------------------------------------------------------------------

    def _follow(self, mission: Mission) -> FlownMission:
        flown, begin_s = FlownMission(), self._now_s
        seq = self.vehicle.store.current_seq
        was_open = self.vehicle.state.gripper.output_released
        winches = {item.seq for item in mission.items if item.command is MavCmd.DO_WINCH}
        while self._now_s - begin_s < LONGEST_FLIGHT_S:
            self._step()
            at_s = self._now_s - begin_s
            current = self.vehicle.store.current_seq
            if current != seq:
                self._note_passed(flown, seq, current, at_s)
                if winches & {*range(seq, current)}:
                    flown.releases.append(self._released(at_s))
                seq = current
            is_open = self.vehicle.state.gripper.output_released
            if is_open and not was_open:
                flown.releases.append(self._released(at_s))
            was_open = is_open
            if self._pilot is not None:
                self._pilot.note_orders(flown.ordered_s, at_s)
            if self._is_over(flown, seq, at_s):
                break
        return flown

    def _note_passed(self, flown: FlownMission, before: int, current: int, at_s: float) -> None:
        """Forwards all between were passed; backwards is a jump, which takes no time itself."""
        last = current if current > before else before + 1
        flown.item_ends += [(seq, at_s) for seq in range(before, last)]

    def _is_over(self, flown: FlownMission, seq: int, at_s: float) -> bool:
        status, finished = self.vehicle.state.status, self.vehicle.mission.result.finished
        if not finished:
            return False
        if flown.item_ends[-1:] == [] or flown.item_ends[-1][0] != seq:
            flown.item_ends.append((seq, at_s))
        if not status.landed:
            flown.landed_s = None  # a rover has landed for a moment where its return begins
        elif flown.landed_s is None:
            flown.landed_s = at_s
        airframe = self.vehicle.spec.airframe
        if not status.armed or (status.mode is Mode.LOITER and (airframe.is_rover or airframe.is_airship)):
            flown.ended_s = at_s if flown.landed_s is None else flown.landed_s
            return True
        return False

    def _released(self, at_s: float) -> Released:
        body = self.vehicle.state.body
        place = self.vehicle.spec.frame.to_global(body.north_m, body.east_m)
        return Released(at_s, *place, body.ground_speed_m_s)

    # time ---------------------------------------------------------------------------------------------------

    def _fly(self, seconds: float) -> None:
        for _ in range(round(seconds / VehicleClock.STEP_S)):
            self._step()

    def _step(self) -> None:
        if self._steps % round(1.0 / VehicleClock.STEP_S) == 0:
            self._send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self._steps += 1
        self._now_s += VehicleClock.STEP_S
        self.vehicle.step()
        self.vehicle.poll()
        if self._pilot is not None and self._steps % LOOK_STEPS == 0:
            self._pilot.look(self._now_s)

    # the link -----------------------------------------------------------------------------------------------

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        """From the vehicle (this object is one of its radio's channels)."""
        if message.get_type() in ("MISSION_REQUEST_INT", "MISSION_ACK"):
            self._requested.append(message)
        if self._pilot is not None:
            self._pilot.receive(message, self._now_s)

    def _upload(self, items: Sequence[MissionItem], mission_type: int) -> None:
        self._send(mavlink.MAVLink_mission_count_message(1, 1, len(items), mission_type, 0))
        while self._requested:
            asked = self._requested.pop()
            self._requested.clear()
            if asked.get_type() == "MISSION_ACK":
                if asked.type != 0:
                    raise RuntimeError(f"the vehicle refused the upload: MAV_MISSION_RESULT {asked.type}")
                return
            self._send(_wire_item(items[asked.seq]))
        raise RuntimeError("the vehicle stopped asking for items")

    def _command(self, command: int, *params: float) -> None:
        p = [*params, *(0.0,) * (7 - len(params))]
        self._send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *p))
        if command in (Cmd.COMPONENT_ARM_DISARM, Cmd.DO_SET_MODE):
            self._fly(0.1)

    def _send(self, message: Message) -> None:
        packed = message.pack(mavlink.MAVLink(None, srcSystem=GROUND[0], srcComponent=GROUND[1]))
        self.vehicle.receive(self, mavlink.MAVLink(None).decode(bytearray(packed)))


def _wire_item(item: MissionItem) -> Message:
    flags = (int(item.current), int(item.autocontinue))
    params = (item.param1, item.param2, item.param3, item.param4)
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, item.seq, int(item.frame), int(item.command), *flags, *params, item.x, item.y, item.z,
        int(item.mission_type),
    )  # fmt: skip
