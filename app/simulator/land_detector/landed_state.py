"""What EXTENDED_SYS_STATE says of the land detector's verdict and the position setpoint."""

from __future__ import annotations

from app.simulator.setpoint import SetpointKind
from app.simulator.wire import LandedState, Mode


def landed_state(landed: bool, mode: Mode, kind: SetpointKind) -> LandedState:
    """PX4's MavlinkStreamExtendedSysState: TAKEOFF and LANDING are the setpoint's type, in the auto modes only."""
    if landed:
        return LandedState.ON_GROUND
    if kind is SetpointKind.TAKEOFF and mode.is_auto:
        return LandedState.TAKEOFF
    if kind is SetpointKind.LAND and mode.is_auto:
        return LandedState.LANDING
    return LandedState.IN_AIR
