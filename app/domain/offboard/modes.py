"""Which modes a vehicle may be in while it is flown by hand, and which facts of its link end that."""

from __future__ import annotations

from typing import Final

from app.domain.offboard.state import OffboardState
from app.domain.ports import DuplicateSystem, LinkFact, LinkLost, Rebooted, StateChanged
from app.domain.reason import Reason, ReasonCode, because
from app.domain.setpoint.means import Means
from app.domain.vehicle import FlightMode, VehicleState

MAY_BE_IN: Final = {
    OffboardState.STREAMING: frozenset({FlightMode.HOLD}),
    OffboardState.SWITCHING: frozenset({FlightMode.HOLD, FlightMode.OFFBOARD}),
    OffboardState.ACTIVE: frozenset({FlightMode.OFFBOARD}),
}
"""The modes of each state; any other was commanded by somebody else or by a failsafe."""
COMMANDED: Final = frozenset({FlightMode.HOLD})
"""While it is flown by commands."""


_ON_THE_WAY: Final = {
    "return": frozenset({FlightMode.HOLD, FlightMode.RETURN}),
    "land": frozenset({FlightMode.HOLD, FlightMode.LAND}),
}
"""A person's command: out of OFFBOARD it goes through Hold."""


def who_acts(state: VehicleState) -> Reason | None:
    """Who else has a vehicle that was left in Hold; None if nobody. An unknown mode is nobody's."""
    if state.in_failsafe:
        return because(ReasonCode.OFFBOARD_FAILSAFE)
    if state.mode not in (FlightMode.HOLD, None):
        return because(ReasonCode.OFFBOARD_MODE_BY_OTHERS, mode=state.mode.value)
    return None


def ended_by(
    fact: LinkFact, state: OffboardState, means: Means, vehicle: VehicleState, commanded: str
) -> Reason | None:
    """Why the vehicle is not ours any more; None if it is. `commanded`: by a person, beside the lease."""
    match fact:
        case LinkLost():
            return because(ReasonCode.OFFBOARD_LINK_LOST)
        case Rebooted():
            return because(ReasonCode.OFFBOARD_REBOOTED)
        case DuplicateSystem():
            return because(ReasonCode.OFFBOARD_QUARANTINED)
        case StateChanged():
            return _taken_away(state, means, vehicle, commanded)
        case _:
            return None


def _taken_away(state: OffboardState, means: Means, vehicle: VehicleState, commanded: str) -> Reason | None:
    expected = MAY_BE_IN.get(state)
    if expected is None:
        return None
    if means is Means.COMMANDS:
        expected = COMMANDED
    if vehicle.mode not in expected:
        if vehicle.mode in _ON_THE_WAY.get(commanded, ()) and not vehicle.in_failsafe:
            return because(ReasonCode.OFFBOARD_COMMANDED, command=commanded)
        mode = "an unknown" if vehicle.mode is None else vehicle.mode.value
        failsafe = vehicle.in_failsafe
        code = ReasonCode.OFFBOARD_FAILSAFE_MODE if failsafe else ReasonCode.OFFBOARD_MODE_BY_OTHERS
        return because(code, mode=mode)
    if means is Means.COMMANDS and vehicle.in_failsafe:
        return because(ReasonCode.OFFBOARD_FAILSAFE_IN_HOLD)
    return because(ReasonCode.OFFBOARD_DISARMED) if vehicle.armed is False else None
