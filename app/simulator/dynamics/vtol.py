"""A VTOL: a multicopter that becomes a fixed wing in the air, and back."""

from __future__ import annotations

import math
from dataclasses import replace

from app.simulator.dynamics.fixed_wing import FixedWing
from app.simulator.dynamics.hovering_wing import WingedControl, air_force, push_m_s2
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.multicopter import Multicopter
from app.simulator.dynamics.position_control import CLIMB_GAIN
from app.simulator.geo import wrap_pi
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import Body, Status
from app.simulator.wire import VtolState

GRAVITY_M_S2 = 9.81
WAITS_M_S = 0.001
LEVELS_S = 2.0
BRAKING_M_S2 = 2.0  # VT_B_DEC_MSS
LONGEST_BACK_S = 10.0  # VT_B_TRANS_DUR


class Vtol:
    """Owns `status.vtol_state`."""

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._status = status
        self._control = WingedControl(params)
        self._hover = Multicopter(params, status, hover_throttle, self._control)
        self._wing = FixedWing(params)
        self._since_s = 0.0
        self._climb_m_s = 0.0
        """Asked for in a transition to the wing: what it had, going to zero."""

    def reset(self, body: Body) -> None:
        """Back to multicopter, where the body is."""
        self._status.vtol_state = VtolState.MC
        self._hover.reset(body)

    def transition(self, wanted: int) -> None:
        """Begin; nothing happens when the vehicle is there already or on its way."""
        state = self._status.vtol_state
        if wanted == VtolState.FW and state in (VtolState.MC, VtolState.TRANSITION_TO_MC):
            self._status.vtol_state = VtolState.TRANSITION_TO_FW
            self._since_s = 0.0
            self._climb_m_s = math.nan
        elif wanted == VtolState.MC and state in (VtolState.FW, VtolState.TRANSITION_TO_FW):
            self._status.vtol_state = VtolState.TRANSITION_TO_MC
            self._since_s = 0.0

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; the vehicle is armed."""
        state = self._status.vtol_state
        if state != VtolState.MC:
            body.climb_command_m_s = 0.0
        if state == VtolState.FW:
            self._wing.step(body, setpoint, dt_s, wind)
        elif state == VtolState.TRANSITION_TO_FW:
            self._to_wing(body, dt_s, wind)
        elif state == VtolState.TRANSITION_TO_MC:
            self._to_hover(body, dt_s, wind)
        else:
            self._hover.step(body, self._turned_first(body, setpoint), dt_s, wind)

    def _turned_first(self, body: Body, setpoint: Setpoint) -> Setpoint:
        """MPC_YAW_MODE 4: towards the waypoint first, then there. It is so on every VTOL [rc.vtol_defaults]."""
        ahead = (setpoint.north_m - body.north_m, setpoint.east_m - body.east_m)
        if setpoint.kind not in (SetpointKind.POSITION, SetpointKind.LOITER) or body.on_ground:
            return setpoint
        wanted = setpoint.yaw_rad
        if math.isnan(wanted) and math.hypot(*ahead) > setpoint.acceptance_radius_m:
            wanted = math.atan2(ahead[1], ahead[0])
        missing = wrap_pi(wanted - body.yaw_rad)
        if math.isnan(missing) or abs(missing) < math.radians(float(self._params["MIS_YAW_ERR"])):
            return setpoint
        return replace(setpoint, cruise_speed_m_s=WAITS_M_S)

    def _to_wing(self, body: Body, dt_s: float, wind: Wind) -> None:
        """Push ahead, the propeller gaining speed, until the wing carries; level, with lift motors that cannot pull."""
        self._since_s += dt_s
        if math.isnan(self._climb_m_s):
            self._climb_m_s = body.v_up_m_s
        airspeed = _airspeed_m_s(body, wind)
        throttle = self._since_s * float(self._params["VT_PSHER_SLEW"])
        force = air_force(airspeed, -body.v_up_m_s)
        gained = push_m_s2(throttle, airspeed) - force.backward_m_s2
        body.v_north_m_s += gained * math.cos(body.yaw_rad) * dt_s
        body.v_east_m_s += gained * math.sin(body.yaw_rad) * dt_s
        self._climb_m_s -= self._climb_m_s * dt_s / LEVELS_S
        held = CLIMB_GAIN * (
            self._climb_m_s - body.v_up_m_s
        )  # no more than the lift motors' own thrust can be taken away
        body.v_up_m_s += max(held, -force.downward_m_s2 - GRAVITY_M_S2) * dt_s
        self._move(body, dt_s)
        long_enough = self._since_s > float(self._params["VT_TRANS_MIN_TM"])
        if long_enough and _airspeed_m_s(body, wind) >= float(self._params["VT_ARSP_TRANS"]):
            self._status.vtol_state = VtolState.FW
            self._control.learn_hover_thrust()
            self._wing.reset(body)

    def _to_hover(self, body: Body, dt_s: float, wind: Wind) -> None:
        """The pusher stops and the air brakes, until the vehicle is no faster ahead than it hovers."""
        self._since_s += dt_s
        airspeed = _airspeed_m_s(body, wind)
        force = air_force(airspeed, -body.v_up_m_s)
        braking = max(force.backward_m_s2, BRAKING_M_S2)  # in a tail wind the pitch has to brake
        body.v_north_m_s -= braking * math.cos(body.yaw_rad) * dt_s
        body.v_east_m_s -= braking * math.sin(body.yaw_rad) * dt_s
        body.v_up_m_s *= 0.95
        self._move(body, dt_s)
        ahead = body.v_north_m_s * math.cos(body.yaw_rad) + body.v_east_m_s * math.sin(body.yaw_rad)
        if ahead < float(self._params["MPC_XY_CRUISE"]) or self._since_s > LONGEST_BACK_S:
            self._status.vtol_state = VtolState.MC
            self._hover.reset(body)

    def _move(self, body: Body, dt_s: float) -> None:
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)


def _airspeed_m_s(body: Body, wind: Wind) -> float:
    """Along the nose."""
    north, east = body.v_north_m_s - wind.north_m_s, body.v_east_m_s - wind.east_m_s
    return north * math.cos(body.yaw_rad) + east * math.sin(body.yaw_rad)
