"""A VTOL: a multicopter that becomes a fixed wing in the air, and back."""

from __future__ import annotations

import math

from app.simulator.dynamics.fixed_wing import FixedWing
from app.simulator.dynamics.model import Wind
from app.simulator.dynamics.multicopter import Multicopter
from app.simulator.params import Params
from app.simulator.setpoint import Setpoint
from app.simulator.state import Body, Status
from app.simulator.wire import VtolState

FORWARD_ACCELERATION = 4.4
"""Reaches VT_ARSP_TRANS about 2.4 s after the command."""
BACK_TRANSITION_S = 0.6
BACK_DECELERATION = 11.0


class Vtol:
    """Owns `status.vtol_state`."""

    def __init__(self, params: Params, status: Status, hover_throttle: float) -> None:
        self._params = params
        self._status = status
        self._hover = Multicopter(params, status, hover_throttle)
        self._wing = FixedWing(params)
        self._since_s = 0.0

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
            self._to_hover(body, dt_s)
        else:
            self._hover.step(body, setpoint, dt_s, wind)

    def _to_wing(self, body: Body, dt_s: float, wind: Wind) -> None:
        """Push ahead until the wing carries."""
        speed = body.ground_speed_m_s + FORWARD_ACCELERATION * dt_s
        body.v_north_m_s = speed * math.cos(body.yaw_rad)
        body.v_east_m_s = speed * math.sin(body.yaw_rad)
        body.v_up_m_s *= 0.98
        self._move(body, dt_s)
        airspeed = math.hypot(body.v_north_m_s - wind.north_m_s, body.v_east_m_s - wind.east_m_s)
        if airspeed >= float(self._params["VT_ARSP_TRANS"]):
            self._status.vtol_state = VtolState.FW
            self._wing.reset(body)

    def _to_hover(self, body: Body, dt_s: float) -> None:
        self._since_s += dt_s
        speed = body.ground_speed_m_s
        keep = max(0.0, speed - BACK_DECELERATION * dt_s) / speed if speed > 0.1 else 0.0
        body.v_north_m_s *= keep
        body.v_east_m_s *= keep
        body.v_up_m_s *= 0.95
        self._move(body, dt_s)
        if self._since_s >= BACK_TRANSITION_S:
            self._status.vtol_state = VtolState.MC
            self._hover.reset(body)

    def _move(self, body: Body, dt_s: float) -> None:
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
