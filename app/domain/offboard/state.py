"""How far offboard control of a vehicle is, what may follow, and the lease that it needs."""

from __future__ import annotations

import hmac
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from app.domain.errors import LeaseLostError
from app.domain.offboard.control_method import ControlMethod
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle import facts
from app.domain.vehicle.facts import LinkFact
from app.domain.vehicle.state import FlightMode, VehicleState


class OffboardState(StrEnum):
    """How far offboard control is. A vehicle in `leased` is not commanded yet."""

    IDLE = "idle"
    LEASED = "leased"
    CHECKING = "checking"
    HOLDING = "holding"
    STREAMING = "streaming"
    SWITCHING = "switching"
    ACTIVE = "active"
    LEAVING = "leaving"


_S = OffboardState
TRANSITIONS: Final[Mapping[OffboardState, frozenset[OffboardState]]] = {
    _S.IDLE: frozenset({_S.LEASED}),
    _S.LEASED: frozenset({_S.CHECKING, _S.IDLE}),
    _S.CHECKING: frozenset({_S.HOLDING, _S.LEASED, _S.IDLE}),
    _S.HOLDING: frozenset({_S.STREAMING, _S.ACTIVE, _S.LEASED, _S.IDLE}),  # controlled by commands, it stays in Hold
    _S.STREAMING: frozenset({_S.SWITCHING, _S.LEASED, _S.IDLE}),
    _S.SWITCHING: frozenset({_S.ACTIVE, _S.LEASED, _S.IDLE}),
    _S.ACTIVE: frozenset({_S.LEAVING, _S.IDLE}),
    _S.LEAVING: frozenset({_S.ACTIVE, _S.IDLE}),
}
"""What may follow each state: an entry that fails goes back to `leased`, a leaving that fails to `active`."""
SENDING: Final = frozenset({_S.STREAMING, _S.SWITCHING, _S.ACTIVE, _S.LEAVING})
"""Setpoints flow, if it is flown by setpoints."""


ENTERING: Final = frozenset({_S.CHECKING, _S.HOLDING, _S.STREAMING, _S.SWITCHING})
"""An entry is under way."""


class LeaseChange(StrEnum):
    """What became of a lease. The last three end it."""

    ACQUIRED = "acquired"
    HANDED_OVER = "handed_over"
    OVERRIDDEN = "overridden"
    OFFERED = "offered"
    RELEASED = "released"
    EXPIRED = "expired"
    REVOKED = "revoked"

    @property
    def ends(self) -> bool:
        """Whether the lease is free afterwards."""
        return self in (LeaseChange.RELEASED, LeaseChange.EXPIRED, LeaseChange.REVOKED)


@dataclass(frozen=True, slots=True)
class Lease:
    """The exclusive, expiring right of one client to offboard control of one vehicle.

    `id` is the holder's secret. `expires_s` is monotonic. `offered_to` may take it over.
    """

    id: str
    vehicle_id: str
    holder: str
    expires_s: float
    offered_to: str | None = None


@dataclass(frozen=True, slots=True)
class Control:
    """Offboard control of one vehicle. `reason` explains the state, or why the last lease ended.

    `commanded`: the last command of a user without the lease, since it was acquired or the entry began.
    `hold_is_pending`: the Hold command after the end of control is not answered yet.
    """

    vehicle_id: str
    lease_s: float
    state: OffboardState = OffboardState.IDLE
    reason: Reason | None = None
    lease: Lease | None = None
    control_method: ControlMethod = ControlMethod.SETPOINTS
    commanded: str = ""
    hold_is_pending: bool = False

    @property
    def is_commanded(self) -> bool:
        """Whether it is controlled by commands, in Hold mode."""
        return self.control_method is ControlMethod.COMMANDS

    @property
    def holder(self) -> str | None:
        return None if self.lease is None else self.lease.holder

    def has(self, lease_id: str) -> bool:
        """Whether this is still the lease, expired or not."""
        return self.lease is not None and hmac.compare_digest(self.lease.id.encode(), lease_id.encode())

    def held(self, lease_id: str, now_s: float) -> Lease:
        """The lease with this id, as it is. Raises LeaseLostError for any other."""
        if self.lease is None or now_s >= self.lease.expires_s or not self.has(lease_id):
            raise LeaseLostError(
                f"no such lease of vehicle {self.vehicle_id}, or it has ended",
                hint="acquire the lease again, then enter again",
            )
        return self.lease


MAY_BE_IN: Final = {
    OffboardState.STREAMING: frozenset({FlightMode.HOLD}),
    OffboardState.SWITCHING: frozenset({FlightMode.HOLD, FlightMode.OFFBOARD}),
    OffboardState.ACTIVE: frozenset({FlightMode.OFFBOARD}),
}
"""The expected modes of each state; any other was commanded by somebody else or by a failsafe."""
COMMANDED: Final = frozenset({FlightMode.HOLD})
"""While it is flown by commands."""


_MODES_AFTER: Final = {
    "hold": frozenset({FlightMode.HOLD}),
    "return": frozenset({FlightMode.HOLD, FlightMode.RETURN}),
    "land": frozenset({FlightMode.HOLD, FlightMode.LAND}),
}
"""After a user's command: the vehicle leaves OFFBOARD through Hold."""


def who_acts(state: VehicleState) -> Reason | None:
    """Return who else controls a vehicle that was left in Hold; None if nobody does. An unknown mode counts as
    nobody.
    """
    if state.mode not in (FlightMode.HOLD, None) and not state.in_failsafe:
        return Reason.of(ReasonCode.OFFBOARD_MODE_BY_OTHERS, mode=state.mode.value)
    return Reason.of(ReasonCode.OFFBOARD_FAILSAFE) if state.may_be_in_failsafe else None


def ended_by(
    fact: LinkFact, state: OffboardState, control_method: ControlMethod, vehicle: VehicleState, commanded: str
) -> Reason | None:
    """Why the vehicle is not ours any more; None if it is. `commanded`: by a person, beside the lease."""
    match fact:
        case facts.LinkLost():
            return Reason.of(ReasonCode.OFFBOARD_LINK_LOST)
        case facts.Rebooted():
            return Reason.of(ReasonCode.OFFBOARD_REBOOTED)
        case facts.DuplicateSystem():
            return Reason.of(ReasonCode.OFFBOARD_QUARANTINED)
        case facts.StateChanged():
            return _taken_away(state, control_method, vehicle, commanded)
        case (
            facts.LinkRestored()
            | facts.IdentityKnown()
            | facts.ParametersChanged()
            | facts.MissionCurrent()
            | facts.ItemReached()
            | facts.GripperOutput()
            | facts.StatusText()
            | facts.ClockRateSet()
            | facts.LinkSecured()
            | facts.QuarantineEnded()
            | facts.SentInQuarantine()
        ):
            return None


def _taken_away(
    state: OffboardState, control_method: ControlMethod, vehicle: VehicleState, commanded: str
) -> Reason | None:
    expected = MAY_BE_IN.get(state)
    if expected is None:
        return None
    if vehicle.is_terminated:
        return Reason.of(ReasonCode.OFFBOARD_FAILSAFE)
    if control_method is ControlMethod.COMMANDS:
        expected = COMMANDED
    if vehicle.mode not in expected:
        if vehicle.mode in _MODES_AFTER.get(commanded, ()) and not vehicle.in_failsafe:
            return Reason.of(ReasonCode.OFFBOARD_COMMANDED, command=commanded)
        mode = "an unknown" if vehicle.mode is None else vehicle.mode.value
        failsafe = vehicle.in_failsafe
        code = ReasonCode.OFFBOARD_FAILSAFE_MODE if failsafe else ReasonCode.OFFBOARD_MODE_BY_OTHERS
        return Reason.of(code, mode=mode)
    if control_method is ControlMethod.COMMANDS and vehicle.may_be_in_failsafe:
        return Reason.of(ReasonCode.OFFBOARD_FAILSAFE_IN_HOLD)
    return Reason.of(ReasonCode.OFFBOARD_DISARMED) if vehicle.armed is False else None
