"""Offboard control as one pure function: what each input makes of it, and what is to be done."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import LeaseHeldError, OffboardNotReadyError
from app.domain.offboard import inputs as what
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.inputs import Do, Effect, Input, OfLease, OnTheWay, RecordLease, RecordState, Start
from app.domain.offboard.state import SENDING, TRANSITIONS, Control, LeaseChange, OffboardState, ended_by, who_acts
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import LinkFact, StateChanged
from app.domain.vehicle.state import FlightMode, VehicleState


class Silence(StrEnum):
    """How long the client has been silent, and so what is sent at a tick."""

    SPEAKS = "speaks"
    """Its newest setpoint is fresh: send it."""
    SILENT = "silent"
    """Send a velocity of zero."""
    GONE = "gone"
    """Command Hold, stop sending, end the lease."""


@dataclass(frozen=True, slots=True)
class DeadMan:
    """`max_age_s`: a setpoint older than this is never sent. `gone_s`: then the client counts as gone."""

    max_age_s: float = 0.4
    gone_s: float = 1.0

    def judge(self, age_s: float, kind: FlightKind, *, has_estimate: bool = True) -> Silence:
        """Return the stage for this age of the newest setpoint. For a vehicle that cannot hover the lease ends at
        once.
        """
        if age_s <= self.max_age_s:
            return Silence.SPEAKS
        waits = can_stand(kind) and has_estimate and age_s < self.gone_s
        return Silence.SILENT if waits else Silence.GONE


def can_stand(kind: FlightKind) -> bool:
    """Whether zero velocity makes the vehicle stop."""
    return kind in (FlightKind.ROTARY, FlightKind.ROVER)


Step = tuple[Control, tuple[Effect, ...]]
_S = OffboardState


def step(control: Control, given: Input) -> Step:
    """Return the next state and its effects, in order. A rejected input raises and changes nothing.

    Raises:
        LeaseHeldError, LeaseLostError: of a lease. OffboardNotReadyError: of an entry.
    """
    match given.what:
        case what.Take() | what.Renew() | what.Offer():
            return _of_lease(control, given.what, given)
        case what.Enter() | what.Proceed() | what.EntryFailed() | what.Leave() | what.LeavingFailed():
            return _on_the_way(control, given.what, given.vehicle)
        case what.End(change, reason, holds):
            return _give_up(control, change, reason, given.vehicle) if holds else _end(control, change, reason)
        case what.Commanded(action):
            return _commanded(control, action, given.vehicle)
        case what.Heard(fact):
            return _heard(control, fact, given.vehicle)
        case what.HoldSaid(unconfirmed):
            return _hold_said(replace(control, says_hold=False), unconfirmed, given.vehicle)
        case what.Tick():
            return _expire(control, given)
        case what.Due():
            return _due(control, given.vehicle)


def _of_lease(control: Control, it: OfLease, given: Input) -> Step:
    if isinstance(it, what.Take):
        return _take(control, it, given)
    lease = replace(control.held(it.lease_id, given.now_s), expires_s=given.now_s + control.lease_s)
    if isinstance(it, what.Renew):
        return replace(control, lease=lease), ()
    control = replace(control, lease=replace(lease, offered_to=it.to))
    recorded = RecordLease(LeaseChange.OFFERED, lease.holder, other=it.to)
    return control, (recorded, Do.SHOW)


def _take(control: Control, it: what.Take, given: Input) -> Step:
    control, effects = _expire(control, given)
    before, holder = control.lease, it.lease.holder
    effects += (Do.CLEAR_SETPOINT, Do.COUNT_SILENCE)
    if before is None:
        control = replace(control, lease=it.lease, control_method=it.control_method, commanded="")
        control, moved = _move(control, _S.LEASED, None)
        return control, (*effects, Start(it.rate_hz), RecordLease(LeaseChange.ACQUIRED, holder), *moved)
    if not it.override and before.offered_to != holder:
        raise LeaseHeldError(
            f"{before.holder} has the offboard lease of vehicle {control.vehicle_id}",
            hint="wait until it ends, ask for a hand-over, or let an admin override it",
            holder=before.holder,
            expires_in_s=round(before.expires_s - given.now_s, 1),
        )
    change = LeaseChange.HANDED_OVER if before.offered_to == holder else LeaseChange.OVERRIDDEN
    control = replace(control, lease=it.lease, says_hold=control.says_hold or control.is_commanded)
    hold = (Do.SAY_HOLD,) if control.is_commanded else ()
    return control, (*effects, *hold, RecordLease(change, holder, other=before.holder), Do.STOP_LEAVING, Do.SHOW)


def _on_the_way(control: Control, it: OnTheWay, vehicle: VehicleState) -> Step:
    """An answer to a lease that is over, or out of turn, changes nothing."""
    if control.lease is None:
        return control, ()
    match it:
        case what.Enter(control_method, usual):
            if control.state is not _S.LEASED:
                raise OffboardNotReadyError(f"offboard control is {control.state.value} already")
            if control_method is ControlMethod.COMMANDS and usual is not ControlMethod.COMMANDS:
                raise OffboardNotReadyError("this vehicle is flown by setpoints", hint="enter without `control_method`")
            return replace(control, control_method=control_method or usual or ControlMethod.SETPOINTS), ()
        case what.Proceed(state, reason):
            control, effects = _unsay(control) if state is _S.HOLDING else (control, ())
            control, moved = _move(control, state, reason)
            return control, (*effects, *moved)
        case what.EntryFailed(reason):
            if vehicle.mode is FlightMode.OFFBOARD:
                return _give_up(control, LeaseChange.REVOKED, reason, vehicle)
            return _move(control, _S.LEASED, reason)
        case what.Leave(to):
            control, effects = _unsay(control)
            state = _S.LEAVING if control.state is _S.ACTIVE else control.state
            control, moved = _move(control, state, Reason.of(ReasonCode.OFFBOARD_LEAVING, to=to))
            return control, (*effects, *moved)
        case what.LeavingFailed(to):
            if control.state is not _S.LEAVING:
                return control, ()
            control, moved = _move(control, _S.ACTIVE, Reason.of(ReasonCode.OFFBOARD_LEAVING_FAILED, to=to))
            control, effects = _heard(control, StateChanged(), vehicle)
            return control, (*moved, *effects)


def _move(control: Control, state: OffboardState, reason: Reason | None) -> Step:
    """The next state, if the table allows it. Under control the dead-man counts from here."""
    if state is not control.state and state not in TRANSITIONS[control.state]:
        return control, ()
    counts = (Do.COUNT_SILENCE,) if state is _S.ACTIVE else ()
    if (state, reason) == (control.state, control.reason):
        return control, (*counts, Do.SHOW)
    recorded = RecordState(state=state, holder=control.holder, reason=reason)
    return replace(control, state=state, reason=reason), (*counts, recorded, Do.SHOW)


def _end(control: Control, change: LeaseChange, reason: Reason) -> Step:
    """End the lease and stop sending; command nothing. Idempotent."""
    if control.lease is None:
        return control, ()
    ended = RecordLease(change, control.lease.holder, reason=reason)
    control, moved = _move(replace(control, lease=None), _S.IDLE, reason)
    return control, (Do.STOP, ended, *moved)


def _give_up(control: Control, change: LeaseChange, reason: Reason, vehicle: VehicleState) -> Step:
    """End the lease, and command Hold if the vehicle is under offboard control."""
    mode = FlightMode.HOLD if control.is_commanded else FlightMode.OFFBOARD
    follows = control.state is _S.SWITCHING or (control.state in SENDING and vehicle.mode in (mode, None))
    control, effects = _end(control, change, reason)
    return (replace(control, says_hold=True), (*effects, Do.SAY_HOLD)) if follows else (control, effects)


def _expire(control: Control, given: Input) -> Step:
    if control.lease is None or given.now_s < control.lease.expires_s:
        return control, ()
    reason = Reason.of(ReasonCode.OFFBOARD_NOT_RENEWED, lease_s=control.lease_s)
    return _give_up(control, LeaseChange.EXPIRED, reason, given.vehicle)


def _unsay(control: Control) -> Step:
    """A new command is newer than a pending Hold command after the end of control."""
    return (replace(control, says_hold=False), (Do.UNSAY_HOLD,)) if control.says_hold else (control, ())


def _commanded(control: Control, action: str, vehicle: VehicleState) -> Step:
    """A fixed wing controlled by commands is in Hold mode already, so the mode is no evidence; while entering and
    leaving it is ours.
    """
    control = replace(control, commanded=action)
    if action not in ("", "hold"):
        return _unsay(control)
    if action == "hold" and control.is_commanded and control.state is _S.ACTIVE:
        reason = Reason.of(ReasonCode.OFFBOARD_COMMANDED, command=action)
        return _give_up(control, LeaseChange.REVOKED, reason, vehicle)
    return control, ()


def _heard(control: Control, fact: LinkFact, vehicle: VehicleState) -> Step:
    """Never override somebody else's mode: stream and pending Hold end at once, because they would change it back."""
    effects: tuple[Effect, ...] = ()
    ours = vehicle.mode is FlightMode.OFFBOARD and not control.is_commanded  # the pending Hold would leave it
    if control.says_hold and who_acts(vehicle) and not ours:
        control, effects = _unsay(control)
    if reason := ended_by(fact, control.state, control.control_method, vehicle, control.commanded):
        control, ended = _end(control, LeaseChange.REVOKED, reason)
        effects += ended
    return control, effects


def _hold_said(control: Control, unconfirmed: str, vehicle: VehicleState) -> Step:
    if not unconfirmed or control.state is not _S.IDLE or (control.is_commanded and who_acts(vehicle)):
        return control, ()
    circles = control.is_commanded
    code = ReasonCode.OFFBOARD_CIRCLE_UNCONFIRMED if circles else ReasonCode.OFFBOARD_HOLD_UNCONFIRMED
    return _move(control, _S.IDLE, Reason.of(code, control.reason, detail=unconfirmed))


def _due(control: Control, vehicle: VehicleState) -> Step:
    if not control.is_commanded:
        return control, (Do.SEND,) if control.state in SENDING else ()
    if control.state is not _S.ACTIVE or control.says_hold:
        return control, ()  # a command now would be cancelled by the Hold that is still pending
    if acts := who_acts(vehicle):  # observed while leaving, which failed
        return _end(control, LeaseChange.REVOKED, acts)
    return control, (Do.ORDER,)
