"""Is the vehicle landed? Simple rules per vehicle type, with the delays that a real one shows on the wire."""

from __future__ import annotations

from app.simulator.airframe import Airframe
from app.simulator.clock import VehicleClock
from app.simulator.setpoint import Setpoint, SetpointKind
from app.simulator.state import VehicleState
from app.simulator.wire import LandedState, Mode

SPOOL_UP_S = 1.0
"""COM_SPOOLUP_TIME: no thrust before, counted from arming."""
TAKEOFF_DETECTED_S = 0.8
"""A multicopter with its motors turning leaves "landed" this long after a takeoff setpoint, before it lifts off."""
DISARMED_LANDED_S, PLANE_DISARMED_LANDED_S = 0.3, 2.0
"""From disarming close above the ground to "landed" [14_infeasible_quad, 14_infeasible_plane]."""
LAND_DETECTED_S = 2.3
"""From touching the ground to "landed": thrust falls slowly, then three stages of 1/3 s."""
PLANE_TAKEOFF_M_S = 10.5
PLANE_LANDED_M_S = 0.9
ROVER_MOVES_S = 0.6


class LandDetector:
    """Writes `landed_state`."""

    def __init__(self, state: VehicleState, airframe: Airframe, clock: VehicleClock) -> None:
        self._state = state
        self._airframe = airframe
        self._clock = clock
        self._since_s: float | None = None
        self._was_armed = False

    def boot(self) -> None:
        """On the ground until the contrary is seen."""
        self._since_s = None
        self._was_armed = False
        self._state.status.landed_state = LandedState.ON_GROUND

    def step(self, setpoint: Setpoint) -> None:
        """One cycle."""
        status = self._state.status
        landed = self._landed(setpoint)
        if landed:
            status.landed_state = LandedState.ON_GROUND
        elif self._airframe.is_rover or not status.armed:
            status.landed_state = LandedState.IN_AIR
        elif setpoint.kind is SetpointKind.LAND and not self._waits_for_takeoff(setpoint):
            status.landed_state = LandedState.LANDING
        elif setpoint.kind is SetpointKind.TAKEOFF:
            status.landed_state = LandedState.TAKEOFF
        else:
            status.landed_state = LandedState.IN_AIR

    def _waits_for_takeoff(self, setpoint: Setpoint) -> bool:
        return setpoint.kind is SetpointKind.LAND and self._state.status.landed

    def _held(self, condition: bool, seconds: float) -> bool:
        """Whether `condition` has been true for this long."""
        if not condition:
            self._since_s = None
            return False
        if self._since_s is None:
            self._since_s = self._clock.now_s
        return self._clock.now_s - self._since_s >= seconds

    def _landed(self, setpoint: Setpoint) -> bool:
        status, body = self._state.status, self._state.body
        if status.armed != self._was_armed:
            self._was_armed = status.armed
            self._since_s = None
        if not status.armed:
            delay_s = PLANE_DISARMED_LANDED_S if self._airframe.is_fixed_wing else DISARMED_LANDED_S
            return status.landed or self._airframe.is_rover or self._held(body.up_m <= 0.5, delay_s)
        if self._airframe.is_rover:
            return self._rover(status.landed, setpoint)
        if self._airframe.is_airship:
            return False
        if self._airframe.is_fixed_wing:
            return self._plane(status.landed)
        if status.landed:
            wants_up = setpoint.kind not in (SetpointKind.IDLE, SetpointKind.LAND)
            turning = self._clock.now_s >= status.armed_at_s + SPOOL_UP_S
            left = self._held(turning and wants_up and setpoint.up_m > body.up_m + 0.1, TAKEOFF_DETECTED_S)
            if left:
                self._since_s = None
            return not left
        resting = body.on_ground and setpoint.kind in (SetpointKind.LAND, SetpointKind.IDLE)
        landed = self._held(resting, LAND_DETECTED_S)
        if landed:
            self._since_s = None
        return landed

    def _plane(self, was_landed: bool) -> bool:
        body = self._state.body
        if was_landed:
            return body.ground_speed_m_s < PLANE_TAKEOFF_M_S and body.on_ground
        return body.on_ground and body.ground_speed_m_s < PLANE_LANDED_M_S

    def _rover(self, was_landed: bool, setpoint: Setpoint) -> bool:
        """Landed only when disarmed, in land mode or at the end of a return; leaves soon after arming."""
        mode = self._state.status.mode
        if mode is Mode.LAND or (mode is Mode.RTL and setpoint.kind is SetpointKind.LAND):
            return True
        return was_landed and not self._held(True, ROVER_MOVES_S)
