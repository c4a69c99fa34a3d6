"""A ground station without sockets: drives one simulated vehicle step by step, through real MAVLink bytes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message, mavlink
from app.simulator.fleet import build_vehicle
from app.simulator.options import Options, VehicleOptions
from app.simulator.params import Value
from app.simulator.wire import Cmd, Mode

GROUND = (245, 190)
METRES_PER_DEGREE = 111_194.926
NAN = math.nan
DECODER = mavlink.MAVLink(None)


@dataclass(frozen=True)
class ReceivedMessage:
    """One message from the vehicle. `t_s` is vehicle time since the ground station began, over reboots too."""

    t_s: float
    name: str
    data: bytes
    component: int

    @cached_property
    def message(self) -> Message:
        """As its bytes say; read when it is looked at, for most of what a vehicle says in a flight is not."""
        return DECODER.decode(bytearray(self.data))


@dataclass
class Wire:
    """A channel as the vehicle's radio sees it; every message is packed, and parsed by whoever looks at it."""

    gcs: GroundStation
    gcs_heard_s: float | None = None
    _packers: dict[tuple[int, int], Message] = field(default_factory=dict)

    def send(self, message: Message, system_id: int, component_id: int) -> None:
        packer = self._packers.get((system_id, component_id))
        if packer is None:
            packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=component_id)
            self._packers[system_id, component_id] = packer
        data = bytes(message.pack(packer))
        self.gcs.received.append(ReceivedMessage(self.gcs.now_s, message.get_type(), data, component_id))


@dataclass(frozen=True)
class Plan:
    """An item to upload, relative to the vehicle's start point in metres."""

    command: int
    north_m: float | None = None
    east_m: float = 0.0
    up_m: float = 0.0
    params: tuple[float, float, float, float] = (0.0, 0.0, 0.0, NAN)
    frame: int | None = None
    autocontinue: int = 1


def waypoint(north_m: float, east_m: float, up_m: float, hold_s: float = 0.0, radius_m: float = 0.0) -> Plan:
    return Plan(Cmd.NAV_WAYPOINT, north_m, east_m, up_m, (hold_s, radius_m, 0.0, NAN))


def takeoff(up_m: float, north_m: float = 0.0, pitch_deg: float = 0.0, command: int = Cmd.NAV_TAKEOFF) -> Plan:
    return Plan(command, north_m, 0.0, up_m, (pitch_deg, 0.0, 0.0, NAN))


def land(north_m: float = 0.0, east_m: float = 0.0, command: int = Cmd.NAV_LAND) -> Plan:
    return Plan(command, north_m, east_m, 0.0)


def do(command: int, *params: float) -> Plan:
    p = (*params, 0.0, 0.0, 0.0, 0.0)[:4]
    return Plan(command, params=(p[0], p[1], p[2], p[3]))


RELEASE = do(Cmd.DO_GRIPPER, 1, 0)
GRAB = do(Cmd.DO_GRIPPER, 1, 1)
RETURN = do(Cmd.NAV_RETURN_TO_LAUNCH)


class GroundStation:
    """One simulated vehicle and the ground station that talks to it. Time is simulated: nothing here waits."""

    def __init__(
        self,
        airframe: str = "quad",
        *,
        firmware: str = "px4-main",
        params: dict[str, Value] | None = None,
        heartbeats: bool = True,
        ready: bool = True,
        winch: bool = False,
        speed: float = 1.0,
        rates: str = "onboard",
        external_gripper: bool = False,
        others: tuple[str, ...] = (),
    ) -> None:
        self.now_s = 0.0
        self.received: list[ReceivedMessage] = []
        self.heartbeats = heartbeats
        options = Options(fleet=(), firmware=firmware, speed=speed, rates=rates, params=tuple((params or {}).items()))
        entry = VehicleOptions(airframe, 1, winch, external_gripper, others)
        self.vehicle = build_vehicle(options, 0, entry, lambda: self.now_s / speed)
        self.wire = Wire(self)
        self.vehicle.radio.channels.append(self.wire)
        self._next_heartbeat_s = 0.0
        if ready:
            self.fly(6.0)

    # time ---------------------------------------------------------------------------------------------------

    def step(self) -> None:
        """One step of vehicle time."""
        if self.heartbeats and self.now_s >= self._next_heartbeat_s:
            self._next_heartbeat_s = self.now_s + 1.0
            self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        self.now_s += VehicleClock.STEP_S
        self.vehicle.step()
        self.vehicle.poll()

    def fly(self, seconds: float) -> None:
        """Let time pass."""
        end_s = self.now_s + seconds
        while self.now_s < end_s - 1e-9:
            self.step()

    def until(self, condition: Callable[[], object], timeout_s: float = 200.0) -> float:
        """Let time pass until `condition` holds; returns the seconds it took. Fails after `timeout_s`."""
        start_s = self.now_s
        while not condition():
            assert self.now_s - start_s < timeout_s, f"not within {timeout_s} s; {self.where()}"
            self.step()
        return self.now_s - start_s

    # talking ------------------------------------------------------------------------------------------------

    def send(self, message: Message, source: tuple[int, int] = GROUND, wire: Wire | None = None) -> None:
        """Send as `source`."""
        data = message.pack(mavlink.MAVLink(None, srcSystem=source[0], srcComponent=source[1]))
        self.vehicle.receive(wire or self.wire, DECODER.decode(bytearray(data)))

    def command(self, command: int, *params: float, source: tuple[int, int] = GROUND, wait_s: float = 0.1) -> list[int]:
        """COMMAND_LONG; the results of the acks to `source` within `wait_s`."""
        p = [float(value) for value in params] + [0.0] * (7 - len(params))
        mark = len(self.received)
        self.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *p), source)
        self.fly(wait_s)
        return [
            received.message.result
            for received in self.received[mark:]
            if received.name == "COMMAND_ACK"
            and received.message.command == command
            and received.message.target_system == source[0]
        ]

    def set_mode(self, mode: Mode) -> list[int]:
        return self.command(Cmd.DO_SET_MODE, 1, mode >> 16 & 0xFF, mode >> 24)

    def item(self, seq: int, plan: Plan, mission_type: int = 0) -> Message:
        frame = self.vehicle.spec.frame
        x = y = 0
        if plan.north_m is not None:
            latitude, longitude = frame.to_global(plan.north_m, plan.east_m)
            x, y = round(latitude * 1e7), round(longitude * 1e7)
        number = plan.frame if plan.frame is not None else (6 if plan.north_m is not None else 2)
        flags = (int(seq == 0), plan.autocontinue)
        return mavlink.MAVLink_mission_item_int_message(
            1, 1, seq, number, plan.command, *flags, *plan.params, x, y, plan.up_m, mission_type
        )

    def upload(self, plans: Sequence[Plan], mission_type: int = 0) -> int:
        """The whole handshake; returns the MISSION_ACK's type."""
        mark = len(self.received)
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(plans), mission_type, 0))
        while True:
            answers = [h.message for h in self.received[mark:] if h.name in ("MISSION_REQUEST_INT", "MISSION_ACK")]
            mark = len(self.received)
            if not answers:
                raise AssertionError("the vehicle stopped asking")
            if answers[-1].get_type() == "MISSION_ACK":
                return int(answers[-1].type)
            seq = answers[-1].seq
            self.send(self.item(seq, plans[seq], mission_type))

    def arm(self) -> None:
        assert self.command(Cmd.COMPONENT_ARM_DISARM, 1) == [0]

    def start(self, plans: Sequence[Plan]) -> None:
        """Upload, arm, mission mode."""
        assert self.upload(plans) == 0
        self.fly(1.0)
        self.arm()
        assert self.set_mode(Mode.MISSION) == [0]

    # looking ------------------------------------------------------------------------------------------------

    def messages(self, name: str, since_s: float = 0.0) -> list[Message]:
        return [received.message for received in self.received if received.name == name and received.t_s >= since_s]

    def last(self, name: str) -> Message:
        return self.messages(name)[-1]

    def texts(self) -> list[str]:
        return [message.text.rstrip("\t\0") for message in self.messages("STATUSTEXT")]

    def changes(self, name: str, *fields: str) -> list[tuple[int, ...]]:
        """The sequence of values of some fields, repetitions left out."""
        values = [tuple(getattr(message, one) for one in fields) for message in self.messages(name)]
        return [value for index, value in enumerate(values) if index == 0 or values[index - 1] != value]

    def distance_to(self, north_m: float, east_m: float) -> float:
        body = self.vehicle.state.body
        return math.hypot(body.north_m - north_m, body.east_m - east_m)

    @property
    def armed(self) -> bool:
        return self.vehicle.state.status.armed

    def where(self) -> str:
        body, status = self.vehicle.state.body, self.vehicle.state.status
        return (
            f"n {body.north_m:.1f} e {body.east_m:.1f} up {body.up_m:.1f} v {body.ground_speed_m_s:.1f} "
            f"{status.mode.name} seq {self.vehicle.store.current_seq} t {self.vehicle.clock.now_s:.1f}"
        )
