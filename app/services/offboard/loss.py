"""Which facts of a vehicle's link end offboard control."""

from __future__ import annotations

from app.domain.offboard_state import OffboardState
from app.domain.ports import DuplicateSystem, LinkFact, LinkLost, Rebooted, StateChanged, VehicleLink
from app.domain.reason import Reason, ReasonCode, because
from app.domain.setpoint.means import Means
from app.services.offboard.modes import taken_away


def ended_by(fact: LinkFact, state: OffboardState, means: Means, link: VehicleLink, commanded: str) -> Reason | None:
    """Why the vehicle is not ours any more; None if it is. `commanded`: by a person, beside the lease."""
    match fact:
        case LinkLost():
            return because(ReasonCode.OFFBOARD_LINK_LOST)
        case Rebooted():
            return because(ReasonCode.OFFBOARD_REBOOTED)
        case DuplicateSystem():
            return because(ReasonCode.OFFBOARD_QUARANTINED)
        case StateChanged():
            return taken_away(state, means, link.state(), commanded)
        case _:
            return None
