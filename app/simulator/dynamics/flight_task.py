"""PX4's FlightTaskAuto: from the navigator's setpoint to a smooth trajectory, with the limits of this moment."""

from __future__ import annotations

from app.simulator.dynamics.flight_track import FlightTrack
from app.simulator.dynamics.position_smoothing import Leg, Point, PositionSmoothing
from app.simulator.dynamics.velocity_smoothing import VelocitySmoothing
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body

LAND_CRAWL_M = 0.6
LAND_CRAWL_M_S = 0.3


class FlightTask:
    """Owns the trajectory; `axes` is where it is now."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._track = FlightTrack()
        self._smoothing = PositionSmoothing(params)

    @property
    def axes(self) -> tuple[VelocitySmoothing, VelocitySmoothing, VelocitySmoothing]:
        """North, east and up."""
        return self._smoothing.axes

    def reset(self, body: Body) -> None:
        """Begin where the body is, as fast as it is."""
        self._track.reset()
        velocity = (body.v_north_m_s, body.v_east_m_s, body.v_up_m_s)
        self._smoothing.reset((body.north_m, body.east_m, body.up_m), velocity)

    def step(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        """Move the trajectory on towards the setpoint."""
        here = (body.north_m, body.east_m, body.up_m)
        leg = self._leg(here, setpoint)
        landing = setpoint.kind in (SetpointKind.LAND, SetpointKind.DESCEND)
        self._limit_climb(body, setpoint, landing)
        cruise = setpoint.cruise_speed_m_s
        if not cruise > 0.0:
            cruise = float(self._params["MPC_XY_CRUISE"])
        cruise = min(cruise, float(self._params["MPC_XY_VEL_MAX"]))
        self._smoothing.step(here, leg, cruise, self._land_speed(body.up_m, setpoint) if landing else None, dt_s)
        if setpoint.kind is SetpointKind.VELOCITY:
            parts = zip(self.axes, here, setpoint.velocity, setpoint.acceleration, strict=False)
            for axis, place_m, velocity, acceleration in parts:
                axis.reset(place_m, velocity, acceleration)

    def climb_at(self, acceleration_m_s2: float) -> None:
        """It lifts off with its way up well ahead of it."""
        up = self._smoothing.axes[2]
        up.acceleration_m_s2 = min(acceleration_m_s2, float(self._params["MPC_ACC_UP_MAX"]))

    def _leg(self, here: Point, setpoint: Setpoint) -> Leg:
        if setpoint.kind is not SetpointKind.VELOCITY:
            return self._track.leg(here, setpoint)
        self._track.reset()
        above = (here[0], here[1], setpoint.up_m)
        return Leg(here, above, above, setpoint.acceptance_radius_m)

    def _limit_climb(self, body: Body, setpoint: Setpoint, landing: bool) -> None:
        """Downwards, upwards, or slower in the first metres of a takeoff."""
        params, up = self._params, self._smoothing.axes[2]
        if landing or setpoint.up_m < up.position_m:
            up.max_velocity_m_s = float(params["MPC_Z_V_AUTO_DN"])
            up.max_acceleration_m_s2 = float(params["MPC_ACC_DOWN_MAX"])
            return
        up.max_velocity_m_s = float(params["MPC_Z_V_AUTO_UP"])
        up.max_acceleration_m_s2 = float(params["MPC_ACC_UP_MAX"])
        if setpoint.kind is SetpointKind.TAKEOFF and body.up_m < float(params["MPC_LAND_ALT1"]):
            speed = float(params["MPC_TKO_SPEED"])
            up.max_velocity_m_s = speed
            up.max_acceleration_m_s2 = min(up.max_acceleration_m_s2, speed / float(params["MPC_TKO_RAMP_T"]))
            up.position_m = body.up_m

    def _land_speed(self, height_m: float, setpoint: Setpoint) -> float:
        params = self._params
        if setpoint.kind is SetpointKind.DESCEND:  # it may not trust its height above the ground
            return float(params["MPC_LAND_SPEED"])
        high, low = float(params["MPC_LAND_ALT1"]), float(params["MPC_LAND_ALT2"])
        fast, slow = float(params["MPC_Z_V_AUTO_DN"]), float(params["MPC_LAND_SPEED"])
        if height_m < LAND_CRAWL_M:
            return LAND_CRAWL_M_S
        share = max(0.0, min(1.0, (height_m - low) / max(high - low, 0.1)))
        return slow + share * (fast - slow)
