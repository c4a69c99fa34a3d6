"""What every flight mode reads and writes."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.dynamics.position_smoothing import stopping_distance_m
from app.simulator.firmware import FirmwareProfile
from app.simulator.geo import LocalFrame
from app.simulator.navigator.gimbal import Command, GimbalTimer
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Home, VehicleState
from app.simulator.wire import Result, Severity, VtolState

# Whether the payload has acknowledged the mission's gripper or winch item.
#
# From the payload deliverer on board, or from a component outside. Up to v1.15 the mission waits for ACCEPTED; after
# a refusal or a failure the item ends by its time-out alone.


class Deployment:
    """One item at a time."""

    def __init__(self) -> None:
        self.succeeded = False

    def begin(self) -> None:
        """The item's command goes out."""
        self.succeeded = False

    def on_result(self, result: Result) -> None:
        """An ack addressed to the autopilot."""
        self.succeeded = result is Result.ACCEPTED


@dataclass(slots=True)
class NavContext:
    """`setpoint` is what the dynamics follow; `command` issues a vehicle command as the autopilot does internally."""

    state: VehicleState
    params: Params
    system_id: int
    airframe: Airframe
    profile: FirmwareProfile
    frame: LocalFrame
    clock: VehicleClock
    text: Callable[[Severity, str], None]
    event: Callable[..., None]
    command: Callable[[Command], None]
    setpoint: Setpoint = field(default_factory=Setpoint)
    cruise_speed_m_s: float = math.nan
    """Set by DO_CHANGE_SPEED until the mode, or the state of a VTOL, changes."""
    gimbal: GimbalTimer = field(init=False)

    def __post_init__(self) -> None:
        self.gimbal = GimbalTimer(self.system_id)

    @property
    def now_s(self) -> float:
        """Vehicle time."""
        return self.clock.now_s

    @property
    def home(self) -> Home:
        """Home, or the origin while it is unknown."""
        return self.state.status.home or Home(0.0, 0.0, 0.0)

    @property
    def hovers(self) -> bool:
        """Rotary-wing state: the vehicle can stop in the air."""
        if self.airframe.is_vtol:
            return self.state.status.vtol_state in (VtolState.MC, VtolState.TRANSITION_TO_MC)
        return self.airframe.is_multicopter

    @property
    def flies_like_plane(self) -> bool:
        """Fixed-wing state: the vehicle has to keep moving."""
        return self.airframe.is_fixed_wing or (self.airframe.is_vtol and not self.hovers)

    def change_speed(self, speed_m_s: float) -> None:
        """For the leg that is flown and those after it; NaN: the vehicle's own."""
        self.cruise_speed_m_s = self.setpoint.cruise_speed_m_s = speed_m_s

    def stop_point(self) -> tuple[float, float]:
        """Where the vehicle can come to rest (preproject_stop_point); a plane's own place."""
        body = self.state.body
        if not self.hovers:
            return body.north_m, body.east_m
        speed = body.ground_speed_m_s
        if speed < 0.1:
            return body.north_m, body.east_m
        ahead_m = stopping_distance_m(speed, float(self.params["MPC_ACC_HOR"]), float(self.params["MPC_JERK_AUTO"]))
        return (
            body.north_m + body.v_north_m_s / speed * ahead_m,
            body.east_m + body.v_east_m_s / speed * ahead_m,
        )

    @property
    def is_on_loiter(self) -> bool:
        """It circles, or hovers, within reach of its loiter's centre (is_established_on_loiter)."""
        setpoint, body = self.setpoint, self.state.body
        reach_m = float(self.params["NAV_ACC_RAD"]) + setpoint.loiter_radius_m
        away_m = math.dist((body.north_m, body.east_m), setpoint.point)
        return setpoint.kind is SetpointKind.LOITER and away_m <= reach_m

    def loiter_on(self, up_m: float) -> None:
        """At a height, around the loiter that it is on, else around where it is (RtlDirect's climb)."""
        setpoint, body = self.setpoint, self.state.body
        if not self.is_on_loiter:
            self.set_point(SetpointKind.LOITER, (body.north_m, body.east_m), up_m)
            return
        radius_m, clockwise = setpoint.loiter_radius_m, setpoint.loiter_clockwise
        self.set_point(SetpointKind.LOITER, setpoint.point, up_m)
        setpoint.loiter_radius_m, setpoint.loiter_clockwise = radius_m, clockwise

    def end_there(self) -> None:
        """Loiter at the place of the last item, else where it is (setEndOfMissionItems)."""
        setpoint, body = self.setpoint, self.state.body
        if setpoint.kind not in (SetpointKind.POSITION, SetpointKind.LOITER):
            self.set_point(SetpointKind.LOITER, (body.north_m, body.east_m), body.up_m)
            return
        radius_m, clockwise, yaw_rad = setpoint.loiter_radius_m, setpoint.loiter_clockwise, setpoint.yaw_rad
        self.set_point(SetpointKind.LOITER, setpoint.point, setpoint.up_m)
        setpoint.loiter_radius_m, setpoint.loiter_clockwise, setpoint.yaw_rad = radius_m, clockwise, yaw_rad

    def set_point(
        self,
        kind: SetpointKind,
        point: tuple[float, float],
        up_m: float,
        *,
        next_point: tuple[float, float] | None = None,
        previous: tuple[float, float] | None = None,
        acceptance_radius_m: float | None = None,
    ) -> Setpoint:
        """Write the setpoint; everything not given is the vehicle's default."""
        setpoint = self.setpoint
        setpoint.kind = kind
        setpoint.north_m, setpoint.east_m = point
        setpoint.up_m = up_m
        setpoint.next = next_point
        setpoint.next_lands = False
        setpoint.previous = previous
        setpoint.previous_up_m = setpoint.next_up_m = up_m
        radius_m = acceptance_radius_m if acceptance_radius_m else float(self.params["NAV_ACC_RAD"])
        setpoint.acceptance_radius_m = radius_m
        setpoint.cruise_speed_m_s = self.cruise_speed_m_s
        setpoint.loiter_radius_m = abs(float(self.params["NAV_LOITER_RAD"]))
        setpoint.loiter_clockwise = float(self.params["NAV_LOITER_RAD"]) >= 0.0
        setpoint.ramp_to_m = setpoint.approach_slope = setpoint.yaw_rad = math.nan
        return setpoint
