"""Which modes a vehicle may be in while it is flown by hand, and which facts of its link end that."""

from __future__ import annotations

from typing import Final

from app.domain.offboard.state import OffboardState
from app.domain.ports import DuplicateSystem, LinkFact, LinkLost, Rebooted, StateChanged
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


def who_acts(state: VehicleState) -> str:
    """Who else has a vehicle that was left in Hold, in words; empty if nobody. An unknown mode is nobody's."""
    if state.in_failsafe:
        return "a failsafe acts"
    if state.mode not in (FlightMode.HOLD, None):
        return f"{state.mode.value} mode was commanded by somebody else"
    return ""


def ended_by(fact: LinkFact, state: OffboardState, means: Means, vehicle: VehicleState, commanded: str) -> str:
    """Why the vehicle is not ours any more, in words; empty if it is. `commanded`: by a person, beside the lease."""
    match fact:
        case LinkLost():
            return "the link to the vehicle is lost"
        case Rebooted():
            return "the vehicle rebooted"
        case DuplicateSystem():
            return "the vehicle is quarantined"
        case StateChanged():
            return _taken_away(state, means, vehicle, commanded)
        case _:
            return ""


def _taken_away(state: OffboardState, means: Means, vehicle: VehicleState, commanded: str) -> str:
    expected = MAY_BE_IN.get(state)
    if expected is None:
        return ""
    if means is Means.COMMANDS:
        expected = COMMANDED
    if vehicle.mode not in expected:
        if vehicle.mode in _ON_THE_WAY.get(commanded, ()) and not vehicle.in_failsafe:
            return f"{commanded.capitalize()} was commanded"
        mode = "an unknown" if vehicle.mode is None else vehicle.mode.value
        cause = "a failsafe acts" if vehicle.in_failsafe else "commanded by somebody else"
        return f"the vehicle is in {mode} mode: {cause}"
    if means is Means.COMMANDS and vehicle.in_failsafe:
        return "a failsafe acts, in Hold: the next order would end it"
    return "the vehicle disarmed" if vehicle.armed is False else ""
