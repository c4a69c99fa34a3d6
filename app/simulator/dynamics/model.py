"""The face of a vehicle's motion towards the rest of the simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from app.simulator.clock import VehicleClock
from app.simulator.faults import VehicleFaults
from app.simulator.setpoint import Setpoint
from app.simulator.state import Body, VehicleState
from app.simulator.wire import Mode


@dataclass(slots=True)
class Wind:
    """Speed of the air over ground."""

    north_m_s: float = 0.0
    east_m_s: float = 0.0


class Dynamics(Protocol):
    """Moves a body towards a setpoint, one fixed step at a time."""

    def reset(self, body: Body) -> None:
        """Take over a body in any state."""

    def step(self, body: Body, setpoint: Setpoint, dt_s: float, wind: Wind) -> None:
        """Advance by `dt_s`; called only while armed."""

    def transition(self, wanted: int) -> None:
        """VTOL only: change to MAV_VTOL_STATE `wanted` (3 multicopter, 4 fixed wing)."""


FALL_M_S = 8.0
"""Drag does not let it fall faster."""
GRAVITY_M_S2 = 9.81
ROLLS_OUT_M_S2 = 0.71
"""A rover without motors: from 2.95 m/s 6 m (flown twice)."""


class Motion:
    """Moves the body at each step of its time: by its dynamics while armed, else by gravity, in the faults' wind."""

    def __init__(self, state: VehicleState, dynamics: Dynamics, faults: VehicleFaults, *, rolls: bool) -> None:
        self._state = state
        self._dynamics = dynamics
        self._faults = faults
        self._rolls = rolls
        self._wind = Wind(0.0, 0.0)

    def reset(self) -> None:
        """Take over the body in any state."""
        self._dynamics.reset(self._state.body)

    def transition(self, wanted: int) -> None:
        """VTOL only: change to MAV_VTOL_STATE `wanted`."""
        self._dynamics.transition(wanted)

    def step(self, setpoint: Setpoint) -> None:
        """One step of vehicle time."""
        status = self._state.status
        if not status.armed or status.mode is Mode.TERMINATION:
            self._fall()
            return
        faults, wind = self._faults, self._wind
        if wind.north_m_s != faults.wind_north_m_s or wind.east_m_s != faults.wind_east_m_s:
            wind = self._wind = Wind(faults.wind_north_m_s, faults.wind_east_m_s)
        self._dynamics.step(self._state.body, setpoint, VehicleClock.STEP_S, wind)

    def _fall(self) -> None:
        """Without motors, in the air too: straight down to the ground. What has wheels rolls on."""
        body, dt_s = self._state.body, VehicleClock.STEP_S
        body.throttle = body.climb_command_m_s = 0.0
        speed_m_s = body.ground_speed_m_s if self._rolls else 0.0
        kept = max(0.0, 1.0 - ROLLS_OUT_M_S2 * dt_s / speed_m_s) if speed_m_s > 0.0 else 0.0
        body.v_north_m_s *= kept
        body.v_east_m_s *= kept
        body.north_m += body.v_north_m_s * dt_s
        body.east_m += body.v_east_m_s * dt_s
        body.v_up_m_s = max(-FALL_M_S, body.v_up_m_s - GRAVITY_M_S2 * dt_s)
        body.up_m = max(0.0, body.up_m + body.v_up_m_s * dt_s)
        if body.on_ground:
            body.v_up_m_s = 0.0
        self._dynamics.reset(body)
