"""Which facts of a vehicle's link end offboard control."""

from __future__ import annotations

from app.domain.offboard_state import OffboardState
from app.domain.ports import DuplicateSystem, LinkFact, LinkLost, Rebooted, StateChanged, VehicleLink
from app.domain.setpoint.means import Means
from app.services.offboard.modes import taken_away


def ended_by(fact: LinkFact, state: OffboardState, means: Means, link: VehicleLink, commanded: str) -> str:
    """Why the vehicle is not ours any more, in words; empty if it is. `commanded`: by a person, beside the lease."""
    match fact:
        case LinkLost():
            return "the link to the vehicle is lost"
        case Rebooted():
            return "the vehicle rebooted"
        case DuplicateSystem():
            return "the vehicle is quarantined"
        case StateChanged():
            return taken_away(state, means, link.state(), commanded)
        case _:
            return ""
