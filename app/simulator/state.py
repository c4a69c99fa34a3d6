"""What is true about one vehicle at this moment; written by one component each, read by many."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from app.simulator.wire import LandedState, Mode, SystemStatus, VtolState


@dataclass(slots=True)
class Body:
    """Kinematics in the vehicle's local frame (metres, m/s, radians). Written by the dynamics."""

    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    """Above the ground, which is flat."""
    v_north_m_s: float = 0.0
    v_east_m_s: float = 0.0
    v_up_m_s: float = 0.0
    yaw_rad: float = 0.0
    roll_rad: float = 0.0
    pitch_rad: float = 0.0
    throttle: float = 0.0
    """0..1, of the lifting or pushing motors."""
    climb_command_m_s: float = 0.0
    """What the position controller of a hovering vehicle is commanded, up is positive; 0 for the others."""

    @property
    def ground_speed_m_s(self) -> float:
        """Horizontal speed over ground."""
        return float((self.v_north_m_s**2 + self.v_east_m_s**2) ** 0.5)

    @property
    def on_ground(self) -> bool:
        return self.up_m <= 0.01


@dataclass(slots=True)
class Home:
    """HOME_POSITION, in the local frame."""

    north_m: float
    east_m: float
    up_m: float
    yaw_rad: float = 0.0
    set_at_s: float = 0.0


@dataclass(frozen=True, slots=True)
class OrbitStatus:
    """What ORBIT_EXECUTION_STATUS shows, in the local frame."""

    radius_m: float
    """Negative: counter-clockwise."""
    centre: tuple[float, float]
    up_m: float


@dataclass(frozen=True, slots=True)
class LandDetected:
    """vehicle_land_detected: what the land detector published last."""

    freefall: bool = False
    ground_contact: bool = True
    maybe_landed: bool = True
    landed: bool = True
    in_ground_effect: bool = False
    at_rest: bool = False
    published_at_s: float = -math.inf

    @property
    def states(self) -> tuple[bool, bool, bool, bool, bool, bool]:
        """All but the time, in the order above."""
        return (
            self.freefall,
            self.ground_contact,
            self.maybe_landed,
            self.landed,
            self.in_ground_effect,
            self.at_rest,
        )


@dataclass(slots=True)
class Status:
    """What the commander knows."""

    mode: Mode = Mode.LOITER
    intended: Mode = Mode.LOITER
    """What the user asked for last, or what followed it by itself; a failsafe may fly another."""
    armed: bool = False
    armed_at_s: float = 0.0
    failsafe: bool = False
    """One flies the mode, not the user."""
    system_status: SystemStatus = SystemStatus.UNINIT
    landed_state: LandedState = LandedState.ON_GROUND
    """As EXTENDED_SYS_STATE shows it."""
    land: LandDetected = field(default_factory=LandDetected)
    vtol_state: VtolState = VtolState.UNDEFINED
    home: Home | None = None
    battery_fraction: float = 1.0
    battery_warning: int = 0
    """1 low, 2 critical, 3 emergency; armed it only rises."""
    gcs_lost: bool = False
    gcs_loss_counts: bool = False
    """It is lost, and NAV_DLL_ACT has an action against that, which a landing does not need."""
    gps_lost: bool = False
    """No fix now."""
    position_valid: bool = True
    """The estimator still knows where it is."""
    fence_breached: bool = False
    """Outside the fence, and GF_ACTION is set."""

    @property
    def shown_mode(self) -> Mode:
        """As HEARTBEAT and CURRENT_MODE tell it: terminated, PX4 shows the mode that was intended (v1.19, flown)."""
        return self.intended if self.mode is Mode.TERMINATION else self.mode

    @property
    def in_failsafe(self) -> bool:
        """PX4's inFailsafe(): an action, or a warning, which an action becomes when a user takes over."""
        return self.failsafe or self.battery_warning > 0 or self.fence_breached or self.gcs_loss_counts

    @property
    def landed(self) -> bool:
        """The land detector's verdict."""
        return self.land.landed


@dataclass(slots=True)
class GripperState:
    """The gripper as the payload deliverer commanded it; `released` outlives landing and disarming."""

    released: bool = False
    output_released: bool = False
    """The autopilot's output to the servo: the last thing that a link shows."""
    is_open: bool = False
    """What the jaws really do, which nobody senses: differs while stuck or slow."""


@dataclass(slots=True)
class VehicleState:
    """One vehicle, whole."""

    body: Body = field(default_factory=Body)
    status: Status = field(default_factory=Status)
    gripper: GripperState = field(default_factory=GripperState)
    orbit: OrbitStatus | None = None
    """While the vehicle flies a circle. Written by the navigator."""
