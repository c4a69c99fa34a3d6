"""A fixed wing: keeps its airspeed, turns by bank, follows lines and circles, needs a runway.

Speeds, climb and bank are those of PX4's SITL plane: 5.3 m/s up in the takeoff climb, 2 m/s down, 43 degrees of bank.
"""

from __future__ import annotations

import math

from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.path import Course, Point, around_circle, to_line
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body

GRAVITY_M_S2 = 9.81
MAX_BANK_RAD = math.radians(43.0)
ROLL_RATE_RAD_S = math.radians(60.0)
COURSE_GAIN = 0.8885
"""Lateral acceleration per airspeed and sine of the course error."""
RUNWAY_ACCELERATION = 6.5
FULL_PULL_THROTTLE = 0.55
"""From here on the runway acceleration is reached."""
ROLL_OUT_DRAG_PER_S = 0.75
IDLE_DRAG_M_S2 = 4.0
IDLE_HEIGHT_M = 0.45
"""The motor is cut just above the ground [25_land_detector_plane: touches down at 6 m/s]."""
TAKEOFF_CLIMB_M_S = 5.3
CLIMB_RATE_PER_S = 4.0
CLIMBING_OUT = 1.1
"""Airspeed of a takeoff over FW_AIRSPD_MIN: at full power it is a tenth faster than PX4 asks for."""
ALTITUDE_GAIN = 0.2  # 1 / FW_T_ALT_TC
HEIGHT_RATE_SHARE = 0.5  # FW_T_HRATE_FF
CIRCLES_WITHIN = 0.32  # NPFG_SW_DST_MLT
SPEED_RATE_M_S2 = 1.5
BLIND_SINK_M_S = 0.5


class FixedWing:
    """Dynamics of planes, and of a VTOL in fixed-wing flight."""

    def __init__(self, params: Params) -> None:
        self._params = params
        self._airspeed = 0.0
        self._bank = 0.0
        self._blind_s = 0.0
        """Flown without a position."""
        self._reference_m: float | None = None
        """The height that TECS follows: it moves to the wanted one no faster than the vehicle may climb or sink."""
        self._approach_from: Point | None = None
        """Where the landing began, and how far from there it is to its point: never more than it was."""
        self._to_go_m = math.inf
        self._circled: Point | None = None
        """The waypoint that it circles because its height does not fit yet."""
        self._leg: tuple[Point, Point] | None = None
        self._nearest_m = 0.0
        """To the end of that leg, so far: past it the ramp does not run back."""
        self._airborne = False
        self._touched_down = False

    def reset(self, body: Body) -> None:
        """Take over a body in any state."""
        self._airspeed = body.ground_speed_m_s
        self._bank = 0.0
        self._reference_m = self._approach_from = self._circled = None
        self._airborne = not body.on_ground
        self._touched_down = False

    def transition(self, wanted: int) -> None:
        """No VTOL."""

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        if self._airborne:
            self._fly(body, setpoint, dt_s, wind)
        else:
            self._roll_on_ground(body, setpoint, dt_s)

    # on the ground ------------------------------------------------------------------------------------------

    def _roll_on_ground(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        wants_up = setpoint.kind in (SetpointKind.TAKEOFF, SetpointKind.POSITION, SetpointKind.LOITER)
        if wants_up and not self._touched_down:
            if self._airspeed <= 0.0:
                body.yaw_rad = math.atan2(setpoint.east_m - body.east_m, setpoint.north_m - body.north_m)
            ramp_s = max(float(self._params["RWTO_RAMP_TIME"]), dt_s)
            body.throttle = min(1.0, body.throttle + dt_s / ramp_s)
            self._airspeed += RUNWAY_ACCELERATION * min(1.0, body.throttle / FULL_PULL_THROTTLE) * dt_s
            if self._airspeed >= float(self._params["FW_AIRSPD_TRIM"]) * 0.98:
                self._airborne = True
        else:
            self._airspeed = max(0.0, self._airspeed - ROLL_OUT_DRAG_PER_S * self._airspeed * dt_s)
            body.throttle = 0.0
        body.v_north_m_s = self._airspeed * math.cos(body.yaw_rad)
        body.v_east_m_s = self._airspeed * math.sin(body.yaw_rad)
        body.v_up_m_s = 0.0
        body.up_m = 0.0
        body.pitch_rad = body.roll_rad = 0.0
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s

    # in the air ---------------------------------------------------------------------------------------------

    def _fly(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        blind = setpoint.kind is SetpointKind.DESCEND
        self._blind_s = self._blind_s + dt_s if blind else 0.0
        climb = self._blind_climb() if blind else self._climb_command(body, setpoint, dt_s)
        change = max(-CLIMB_RATE_PER_S * dt_s, min(CLIMB_RATE_PER_S * dt_s, climb - body.v_up_m_s))
        body.v_up_m_s += change
        self._set_airspeed(body, setpoint, dt_s)
        if blind:
            self._bank_to(body, math.radians(float(self._params["FW_GPSF_R"])), dt_s)
        else:
            self._bank_towards(body, self._course(body, setpoint), dt_s, wind)
        horizontal = math.sqrt(max(self._airspeed**2 - body.v_up_m_s**2, 1.0))
        body.v_north_m_s = horizontal * math.cos(body.yaw_rad) + wind.north_m_s
        body.v_east_m_s = horizontal * math.sin(body.yaw_rad) + wind.east_m_s
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.up_m += body.v_up_m_s * dt_s
        body.roll_rad = self._bank
        body.pitch_rad = math.asin(max(-0.5, min(0.5, body.v_up_m_s / max(self._airspeed, 1.0))))
        body.throttle = max(0.0, min(1.0, 0.8 + 0.1 * body.v_up_m_s))
        if body.up_m <= 0.0:
            self._touch_down(body)

    def _touch_down(self, body: Body) -> None:
        body.up_m = body.v_up_m_s = 0.0
        self._airborne = False
        self._touched_down = True
        self._airspeed = body.ground_speed_m_s
        self._bank = 0.0
        body.yaw_rad = math.atan2(body.v_east_m_s, body.v_north_m_s)

    def _set_airspeed(self, body: Body, setpoint: Setpoint, dt_s: float) -> None:
        params = self._params
        cruise = setpoint.cruise_speed_m_s
        lowest, highest = float(params["FW_AIRSPD_MIN"]), float(params["FW_AIRSPD_MAX"])
        wanted = float(params["FW_AIRSPD_TRIM"]) * 0.99
        if cruise > 0.0:
            wanted = max(lowest, min(highest, cruise))
        if setpoint.kind is SetpointKind.TAKEOFF:
            wanted = CLIMBING_OUT * lowest
        if body.v_up_m_s < -0.5 or setpoint.kind is SetpointKind.LAND:
            wanted = lowest  # on the whole approach (FW_LND_AIRSPD), or down to a lower orbit
        flares = setpoint.kind is SetpointKind.LAND and body.up_m - setpoint.up_m < IDLE_HEIGHT_M
        if flares:
            self._airspeed = max(0.5 * lowest, self._airspeed - IDLE_DRAG_M_S2 * dt_s)
            return
        step = SPEED_RATE_M_S2 * dt_s
        self._airspeed += max(-step, min(step, wanted - self._airspeed))

    def _climb_command(self, body: Body, setpoint: Setpoint, dt_s: float) -> float:
        """TECS: so much per metre that is missing, and half of the reference's own rate: a descent is flown late."""
        landing = setpoint.kind is SetpointKind.LAND
        if not landing:
            self._approach_from = None
        if setpoint.kind is SetpointKind.TAKEOFF and setpoint.up_m - body.up_m > 1.0:
            self._reference_m = None
            return TAKEOFF_CLIMB_M_S
        wanted_m = self._glide_up_m(body, setpoint) if landing else self._wanted_up_m(body, setpoint)
        before_m = body.up_m if self._reference_m is None else self._reference_m
        rise, sink = (float(self._params[name]) * dt_s for name in ("FW_T_CLMB_R_SP", "FW_T_SINK_R_SP"))
        self._reference_m = before_m + max(-sink, min(rise, wanted_m - before_m))
        rate = (self._reference_m - before_m) / dt_s
        return ALTITUDE_GAIN * (self._reference_m - body.up_m) + HEIGHT_RATE_SHARE * rate

    def _wanted_up_m(self, body: Body, setpoint: Setpoint) -> float:
        """PX4's altitude first order hold: along the line between the heights of two waypoints."""
        if setpoint.previous is None or math.isnan(setpoint.ramp_to_m):
            return setpoint.up_m
        leg_m = math.dist(setpoint.previous, setpoint.point)
        if leg_m <= max(setpoint.ramp_to_m, setpoint.loiter_radius_m):
            return setpoint.up_m
        leg = (setpoint.previous, setpoint.point)
        before_m = self._nearest_m if leg == self._leg else leg_m
        self._leg = leg
        self._nearest_m = min(before_m, math.dist((body.north_m, body.east_m), setpoint.point))
        share = max(0.0, self._nearest_m - setpoint.ramp_to_m) / (leg_m - setpoint.ramp_to_m)
        return setpoint.up_m + share * (setpoint.previous_up_m - setpoint.up_m)

    def _blind_climb(self) -> float:
        """Circles at its height for FW_GPSF_LT, in case the position comes back, and then sinks."""
        return 0.0 if self._blind_s <= float(self._params["FW_GPSF_LT"]) else -BLIND_SINK_M_S

    def _glide_up_m(self, body: Body, setpoint: Setpoint) -> float:
        """Down the line from where the approach began over the landing point, and below it on the other side."""
        slope = setpoint.approach_slope if math.isfinite(setpoint.approach_slope) else 0.08
        ahead = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        if self._approach_from is None:
            self._approach_from = setpoint.previous or (body.north_m, body.east_m)
            self._to_go_m = math.inf
        along = (setpoint.north_m - self._approach_from[0], setpoint.east_m - self._approach_from[1])
        to_go_m = (ahead[0] * along[0] + ahead[1] * along[1]) / max(math.hypot(*along), 1.0)
        self._to_go_m = min(self._to_go_m, to_go_m)
        return min(setpoint.up_m + self._to_go_m * slope, max(body.up_m, setpoint.up_m))

    # steering -----------------------------------------------------------------------------------------------

    def _course(self, body: Body, setpoint: Setpoint) -> Course:
        here = (body.north_m, body.east_m)
        bound_m = max(body.ground_speed_m_s, 1.0) * self._guidance_s()
        if setpoint.kind is SetpointKind.LOITER or self._circles(body, setpoint, bound_m):
            side = 1.0 if setpoint.loiter_clockwise else -1.0
            return around_circle(here, setpoint.point, side * setpoint.loiter_radius_m, bound_m)
        return to_line(here, setpoint.previous, setpoint.point, bound_m, beyond=setpoint.kind is SetpointKind.LAND)

    def _circles(self, body: Body, setpoint: Setpoint, bound_m: float) -> bool:
        """At a waypoint whose height it has not reached a plane circles until it has (handle_setpoint_type)."""
        away_m = math.dist((body.north_m, body.east_m), setpoint.point)
        off = abs(body.up_m - setpoint.up_m) > float(self._params["NAV_FW_ALT_RAD"])
        near = away_m < CIRCLES_WITHIN * bound_m or self._circled == setpoint.point
        waits = setpoint.kind is SetpointKind.POSITION and off and near and not setpoint.next_lands
        self._circled = setpoint.point if waits else None
        return waits

    def _guidance_s(self) -> float:
        """NPFG's time constant. Before v1.14 the guidance was L1; its parameters serve as well."""
        family = "NPFG" if "NPFG_PERIOD" in self._params else "FW_L1"
        return float(self._params[f"{family}_PERIOD"]) * float(self._params[f"{family}_DAMPING"])

    def _bank_towards(self, body: Body, course: Course, dt_s: float, wind: Wind) -> None:
        """Turn the track over ground to the course with a coordinated bank, which also holds a circle."""
        airspeed = max(self._airspeed, 5.0)
        cross = -wind.north_m_s * math.sin(course.rad) + wind.east_m_s * math.cos(course.rad)
        heading = course.rad - math.asin(max(-0.9, min(0.9, cross / airspeed)))
        error = wrap_pi(heading - body.yaw_rad)
        turning = math.sin(error) if abs(error) < math.pi / 2.0 else math.copysign(1.0, error)
        ground_speed = max(0.0, body.v_north_m_s * math.cos(course.rad) + body.v_east_m_s * math.sin(course.rad))
        sideways = COURSE_GAIN * airspeed * turning + course.curvature_per_m * airspeed * ground_speed
        wanted = math.atan(sideways / GRAVITY_M_S2)
        self._bank_to(body, max(-MAX_BANK_RAD, min(MAX_BANK_RAD, wanted)), dt_s)

    def _bank_to(self, body: Body, wanted: float, dt_s: float) -> None:
        airspeed = max(self._airspeed, 5.0)
        step = ROLL_RATE_RAD_S * dt_s
        self._bank += max(-step, min(step, wanted - self._bank))
        body.yaw_rad = wrap_pi(body.yaw_rad + GRAVITY_M_S2 * math.tan(self._bank) / airspeed * dt_s)
