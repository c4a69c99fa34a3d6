"""Reads the setpoint messages: which frames and parts PX4 takes; what it refuses is no proof of life."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from app.simulator.channel import Sender
from app.simulator.clock import VehicleClock
from app.simulator.dialect import Message
from app.simulator.navigator.context import NavContext
from app.simulator.options import MAX_LIVE_SPEED
from app.simulator.params import Params
from app.simulator.wire import VEHICLE_COMPONENT, Severity

Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class OffboardTarget:
    """A setpoint from outside: north, east, up. None was masked out. Metres, m/s, m/s2."""

    position: Vector | None = None
    velocity: Vector | None = None
    acceleration: Vector | None = None
    yaw_rad: float = math.nan
    thrust: float | None = None
    """SET_ATTITUDE_TARGET only."""
    tilt_rad: tuple[float, float] = field(default=(0.0, 0.0))
    """Roll and pitch of SET_ATTITUDE_TARGET."""

    @property
    def is_attitude(self) -> bool:
        """Attitude or body rates with thrust."""
        return self.thrust is not None


CHECK_S = 0.1
"""The commander's checks run at 10 Hz: a stream, or its loss, is seen that late."""


class OffboardStream:
    """Proof of life: the newest valid setpoint is younger than COM_OF_LOSS_T, whatever the rate.

    Above MAX_LIVE_SPEED no stream lives: its sender's timers are wall clock.
    """

    def __init__(self, params: Params, clock: VehicleClock) -> None:
        self._params = params
        self._clock = clock
        clock.on_speed(self._change_speed)
        self.boot()

    def boot(self) -> None:
        """Power-up: nothing was heard."""
        self._heard_at_s: float | None = None
        self.newest: OffboardTarget | None = None
        self.is_seen = False
        """By the last check."""
        self._due_s = CHECK_S

    def step(self) -> None:
        """One cycle."""
        if self._clock.now_s >= self._due_s:
            self._due_s = self._clock.now_s + CHECK_S
            self.is_seen = self._lives

    def receive(self, target: OffboardTarget) -> None:
        """A setpoint that was accepted."""
        self.newest = target
        self._heard_at_s = self._clock.now_s

    def _change_speed(self, factor: float) -> None:
        if self._heard_at_s is not None:
            self._heard_at_s = self._clock.same_by_the_wall(self._heard_at_s, factor)

    @property
    def too_fast(self) -> bool:
        """Simulated time runs too fast for anybody to control the vehicle."""
        return self._clock.speed > MAX_LIVE_SPEED

    @property
    def flies_blind(self) -> bool:
        """Attitude or rates: no position is needed to follow the newest setpoint."""
        return self.newest is not None and self.newest.is_attitude

    @property
    def _lives(self) -> bool:
        if self.too_fast or self._heard_at_s is None:
            return False
        return self._clock.now_s - self._heard_at_s <= float(self._params["COM_OF_LOSS_T"])


LOCAL_NED, BODY_NED = 1, 8
GLOBAL, GLOBAL_INT, GLOBAL_RELATIVE_ALT_INT, GLOBAL_TERRAIN_ALT_INT = 0, 5, 6, 11
IGNORE_X, IGNORE_VX, IGNORE_AX, IGNORE_YAW = 0x1, 0x8, 0x40, 0x400
"""But for the yaw the first bit of three, one an axis."""
IGNORE_ATTITUDE, IGNORE_RATES, IGNORE_THRUST = 0x80, 0x7, 0x40


class OffboardReceiver:
    """Handlers for the router."""

    def __init__(self, context: NavContext, stream: OffboardStream) -> None:
        self._context = context
        self._stream = stream

    def handlers(self) -> dict[str, Callable[[Sender, Message], None]]:
        return {
            "SET_POSITION_TARGET_LOCAL_NED": self._on_local,
            "SET_POSITION_TARGET_GLOBAL_INT": self._on_global,
            "SET_ATTITUDE_TARGET": self._on_attitude,
        }

    def _on_local(self, _channel: Sender, message: Message) -> None:
        if not self._for_me(message):
            return
        mask, frame = message.type_mask, message.coordinate_frame
        position: Vector | None = None
        if frame == LOCAL_NED:
            position = _given(mask, IGNORE_X, (message.x, message.y, -message.z))
        elif frame != BODY_NED:
            self._refuse_frame("SET_POSITION_TARGET_LOCAL_NED", "mavlink_rcv_sp_target_invalid", frame)
            return
        self._take("SET_POSITION_TARGET_LOCAL_NED", message, position, self._velocity(message))

    def _on_global(self, _channel: Sender, message: Message) -> None:
        """AMSL, or above home; without terrain data frame 11 is dropped without a word."""
        if not self._for_me(message):
            return
        mask, frame, home = message.type_mask, message.coordinate_frame, self._context.state.status.home
        if frame not in (GLOBAL, GLOBAL_INT, GLOBAL_RELATIVE_ALT_INT, GLOBAL_TERRAIN_ALT_INT):
            name = "SET_POSITION_TARGET_GLOBAL_INT"
            self._refuse_frame(name, "mavlink_rcv_sp_target_gl_invalid_coord", frame)
            return
        if frame == GLOBAL_TERRAIN_ALT_INT or (frame == GLOBAL_RELATIVE_ALT_INT and home is None):
            return
        local = self._context.frame.to_local(message.lat_int / 1e7, message.lon_int / 1e7)
        relative = frame == GLOBAL_RELATIVE_ALT_INT and home is not None
        ground_m = home.up_m if relative and home is not None else -self._context.frame.altitude_m
        position = _given(mask, IGNORE_X, (*local, message.alt + ground_m))
        self._take("SET_POSITION_TARGET_GLOBAL_INT", message, position, self._velocity(message))

    def _on_attitude(self, _channel: Sender, message: Message) -> None:
        """Attitude or body rates; the thrust is needed with both."""
        if not self._for_me(message) or message.type_mask & IGNORE_THRUST:
            return
        has_attitude = not message.type_mask & IGNORE_ATTITUDE
        if not has_attitude and message.type_mask & IGNORE_RATES == IGNORE_RATES:
            return
        roll, pitch, yaw = _euler(message.q) if has_attitude else (0.0, 0.0, math.nan)
        self._stream.receive(OffboardTarget(yaw_rad=yaw, thrust=message.thrust, tilt_rad=(roll, pitch)))

    def _take(self, name: str, message: Message, position: Vector | None, velocity: Vector | None) -> None:
        acceleration = self._turned(message, IGNORE_AX, (message.afx, message.afy, -message.afz))
        if position is None and velocity is None and acceleration is None:
            self._context.text(Severity.ERROR, f"{name} invalid")
            self._context.event("mavlink_rcv_sp_target_invalid")
            return
        yaw = math.nan if message.type_mask & IGNORE_YAW else message.yaw
        self._stream.receive(OffboardTarget(position, velocity, acceleration, yaw))

    def _velocity(self, message: Message) -> Vector | None:
        return self._turned(message, IGNORE_VX, (message.vx, message.vy, -message.vz))

    def _turned(self, message: Message, first_bit: int, vector: Vector) -> Vector | None:
        """North, east, up; BODY_NED is turned by the heading, and there one ignored axis is all of them."""
        given = _given(message.type_mask, first_bit, vector)
        if given is None or (message.coordinate_frame == BODY_NED and any(map(math.isnan, given))):
            return None
        north, east, up = given
        if message.coordinate_frame == BODY_NED:
            cos, sin = math.cos(self._context.state.body.yaw_rad), math.sin(self._context.state.body.yaw_rad)
            north, east = north * cos - east * sin, north * sin + east * cos
        return north, east, up

    def _refuse_frame(self, name: str, event: str, frame: int) -> None:
        self._context.text(Severity.ERROR, f"{name} invalid coordinate frame {frame}")
        self._context.event(event, frame)

    def _for_me(self, message: Message) -> bool:
        mine = self._context.system_id
        return message.target_system in (0, mine) and message.target_component in (0, VEHICLE_COMPONENT)


def _given(mask: int, first_bit: int, vector: Vector) -> Vector | None:
    """NaN for each axis that the type mask ignores; None when nothing is left."""
    parts = tuple(math.nan if mask & first_bit << axis else value for axis, value in enumerate(vector))
    return None if all(map(math.isnan, parts)) else (parts[0], parts[1], parts[2])


def _euler(q: list[float]) -> Vector:
    """Roll, pitch, yaw in radians of a quaternion w, x, y, z."""
    w, x, y, z = q
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    return roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
