"""Offboard control as one pure function: what each input makes of it, and what is to be done."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from app.domain.autopilot.capability import FlightKind
from app.domain.errors import LeaseHeldError, OffboardNotReadyError
from app.domain.offboard import inputs
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.inputs import (
    ControlAction,
    Effect,
    Input,
    LeaseInput,
    RecordLease,
    RecordState,
    StartStream,
    TransitionInput,
)
from app.domain.offboard.state import (
    ENTERING,
    SENDING,
    TRANSITIONS,
    Control,
    LeaseChange,
    OffboardState,
    ended_by,
    who_acts,
)
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
        waits = can_stop(kind) and has_estimate and age_s < self.gone_s
        return Silence.SILENT if waits else Silence.GONE


def can_stop(kind: FlightKind) -> bool:
    """Whether zero velocity makes the vehicle stop."""
    return kind in (FlightKind.ROTARY, FlightKind.ROVER)


Step = tuple[Control, tuple[Effect, ...]]
_A = ControlAction
_S = OffboardState


def step(control: Control, given: Input) -> Step:
    """Return the next state and its effects, in order. A rejected input raises and changes nothing.

    Raises:
        LeaseHeldError, LeaseLostError: of a lease. OffboardNotReadyError: of an entry.
    """
    match given.content:
        case inputs.AcquireLease() | inputs.RenewLease() | inputs.OfferLease():
            return _change_lease(control, given.content, given)
        case inputs.Enter() | inputs.EntryProgressed() | inputs.EntryFailed() | inputs.Leave() | inputs.LeavingFailed():
            return _enter_or_leave(control, given.content, given.vehicle)
        case inputs.EndLease(change, reason, holds):
            return _end_with_hold(control, change, reason, given.vehicle) if holds else _end(control, change, reason)
        case inputs.UserCommanded(action):
            return _commanded(control, action, given.vehicle)
        case inputs.LinkFactReceived(fact):
            return _link_fact_received(control, fact, given.vehicle)
        case inputs.HoldAnswered(unconfirmed):
            return _hold_answered(replace(control, hold_is_pending=False), unconfirmed, given.vehicle)
        case inputs.Tick():
            return _expire(control, given)
        case inputs.SetpointDue():
            return _setpoint_due(control, given.vehicle)


def _change_lease(control: Control, it: LeaseInput, given: Input) -> Step:
    if isinstance(it, inputs.AcquireLease):
        return _acquire(control, it, given)
    lease = replace(control.held(it.lease_id, given.now_s), expires_s=given.now_s + control.lease_s)
    if isinstance(it, inputs.RenewLease):
        return replace(control, lease=lease), ()
    control = replace(control, lease=replace(lease, offered_to=it.to))
    recorded = RecordLease(LeaseChange.OFFERED, lease.holder, other=it.to)
    return control, (recorded, _A.NOTIFY)


def _acquire(control: Control, it: inputs.AcquireLease, given: Input) -> Step:
    control, effects = _expire(control, given)
    before, holder = control.lease, it.lease.holder
    effects += (_A.CLEAR_SETPOINT, _A.RESTART_DEAD_MAN)
    if before is None:
        control = replace(control, lease=it.lease, control_method=it.control_method, commanded="")
        control, moved = _move(control, _S.LEASED, None)
        return control, (*effects, StartStream(it.rate_hz), RecordLease(LeaseChange.ACQUIRED, holder), *moved)
    if not it.override and before.offered_to != holder:
        raise LeaseHeldError(
            f"{before.holder} has the offboard lease of vehicle {control.vehicle_id}",
            hint="wait until it ends, ask for a hand-over, or let an admin override it",
            holder=before.holder,
            expires_in_s=round(before.expires_s - given.now_s, 1),
        )
    change = LeaseChange.HANDED_OVER if before.offered_to == holder else LeaseChange.OVERRIDDEN
    recorded = RecordLease(change, holder, other=before.holder)
    is_flown = control.is_commanded or control.state is _S.SWITCHING  # which may have been obeyed already
    control = replace(control, lease=it.lease, hold_is_pending=control.hold_is_pending or is_flown)
    hold = (_A.COMMAND_HOLD,) if is_flown else ()
    effects += (_A.STOP_ENTERING_OR_LEAVING, *hold, recorded)
    if control.state not in ENTERING:  # an entry that the new holder has not asked for ends
        return control, (*effects, _A.NOTIFY)
    control, moved = _move(control, _S.LEASED, Reason.of(ReasonCode.OFFBOARD_ENTRY_BROKEN_OFF))
    return control, (*effects, *moved)


def _enter_or_leave(control: Control, it: TransitionInput, vehicle: VehicleState) -> Step:
    """An answer to a lease that is over, or out of turn, changes nothing."""
    if control.lease is None:
        return control, ()
    match it:
        case inputs.Enter(control_method, usual):
            if control.state is not _S.LEASED:
                raise OffboardNotReadyError(f"offboard control is {control.state.value} already")
            if control_method is ControlMethod.COMMANDS and usual is not ControlMethod.COMMANDS:
                raise OffboardNotReadyError("this vehicle is flown by setpoints", hint="enter without `control_method`")
            control_method = control_method or usual or ControlMethod.SETPOINTS
            return replace(control, control_method=control_method, commanded=""), ()
        case inputs.EntryProgressed(state, reason):
            return _progress(control, state, reason, vehicle)
        case inputs.EntryFailed(reason):
            if vehicle.mode is FlightMode.OFFBOARD:
                return _end_with_hold(control, LeaseChange.REVOKED, reason, vehicle)
            return _move(control, _S.LEASED, reason)
        case inputs.Leave(to):
            control, effects = _cancel_hold(control)
            if control.state is not _S.ACTIVE:  # there is nothing to leave but the lease
                return control, effects
            control, moved = _move(control, _S.LEAVING, Reason.of(ReasonCode.OFFBOARD_LEAVING, to=to))
            return control, (*effects, *moved)
        case inputs.LeavingFailed(to):
            if control.state is not _S.LEAVING:
                return control, ()
            control, moved = _move(control, _S.ACTIVE, Reason.of(ReasonCode.OFFBOARD_LEAVING_FAILED, to=to))
            control, effects = _link_fact_received(control, StateChanged(), vehicle)
            return control, (*moved, *effects)


def _progress(control: Control, state: OffboardState, reason: Reason | None, vehicle: VehicleState) -> Step:
    """Judged by the mode as it is now: before this state no change of the mode has ended the entry."""
    if state in TRANSITIONS[control.state]:
        method, commanded = control.control_method, control.commanded
        if ended := ended_by(StateChanged(), state, method, vehicle, commanded):
            return _end(control, LeaseChange.REVOKED, ended)
    control, effects = _cancel_hold(control) if state is _S.HOLDING else (control, ())
    control, moved = _move(control, state, reason)
    return control, (*effects, *moved)


def _move(control: Control, state: OffboardState, reason: Reason | None) -> Step:
    """The next state, if the table allows it. Under control the dead-man counts from here."""
    if state is not control.state and state not in TRANSITIONS[control.state]:
        return control, ()
    counts = (_A.RESTART_DEAD_MAN,) if state is _S.ACTIVE else ()
    if (state, reason) == (control.state, control.reason):
        return control, (*counts, _A.NOTIFY)
    recorded = RecordState(state=state, holder=control.holder, reason=reason)
    return replace(control, state=state, reason=reason), (*counts, recorded, _A.NOTIFY)


def _end(control: Control, change: LeaseChange, reason: Reason) -> Step:
    """End the lease and stop sending; command nothing. Idempotent."""
    if control.lease is None:
        return control, ()
    ended = RecordLease(change, control.lease.holder, reason=reason)
    control, moved = _move(replace(control, lease=None), _S.IDLE, reason)
    return control, (_A.STOP, ended, *moved)


def _end_with_hold(control: Control, change: LeaseChange, reason: Reason, vehicle: VehicleState) -> Step:
    """End the lease, and command Hold if the vehicle is under offboard control."""
    mode = FlightMode.HOLD if control.is_commanded else FlightMode.OFFBOARD
    follows = control.state is _S.SWITCHING or (control.state in SENDING and vehicle.mode in (mode, None))
    control, effects = _end(control, change, reason)
    return (replace(control, hold_is_pending=True), (*effects, _A.COMMAND_HOLD)) if follows else (control, effects)


def _expire(control: Control, given: Input) -> Step:
    if control.lease is None or given.now_s < control.lease.expires_s:
        return control, ()
    reason = Reason.of(ReasonCode.OFFBOARD_NOT_RENEWED, lease_s=control.lease_s)
    return _end_with_hold(control, LeaseChange.EXPIRED, reason, given.vehicle)


def _cancel_hold(control: Control) -> Step:
    """A new command is newer than a pending Hold command after the end of control."""
    return (replace(control, hold_is_pending=False), (_A.CANCEL_HOLD,)) if control.hold_is_pending else (control, ())


def _commanded(control: Control, action: str, vehicle: VehicleState) -> Step:
    """A fixed wing controlled by commands is in Hold mode already, so the mode is no evidence; while entering and
    leaving it is ours.
    """
    is_ours = action == "hold" and (control.state in ENTERING or control.state is _S.LEAVING)
    control = replace(control, commanded="" if is_ours else action)
    if action not in ("", "hold"):
        return _cancel_hold(control)
    if action == "hold" and control.is_commanded and control.state is _S.ACTIVE:
        reason = Reason.of(ReasonCode.OFFBOARD_COMMANDED, command=action)
        return _end_with_hold(control, LeaseChange.REVOKED, reason, vehicle)
    return control, ()


def _link_fact_received(control: Control, fact: LinkFact, vehicle: VehicleState) -> Step:
    """Never override somebody else's mode: stream and pending Hold end at once, because they would change it back."""
    effects: tuple[Effect, ...] = ()
    ours = vehicle.mode is FlightMode.OFFBOARD and not control.is_commanded  # the pending Hold would leave it
    if control.hold_is_pending and who_acts(vehicle) and not ours:
        control, effects = _cancel_hold(control)
    if reason := ended_by(fact, control.state, control.control_method, vehicle, control.commanded):
        control, ended = _end(control, LeaseChange.REVOKED, reason)
        effects += ended
    return control, effects


def _hold_answered(control: Control, unconfirmed: str, vehicle: VehicleState) -> Step:
    if not unconfirmed or control.state is not _S.IDLE or (control.is_commanded and who_acts(vehicle)):
        return control, ()
    circles = control.is_commanded
    code = ReasonCode.OFFBOARD_CIRCLE_UNCONFIRMED if circles else ReasonCode.OFFBOARD_HOLD_UNCONFIRMED
    return _move(control, _S.IDLE, Reason.of(code, control.reason, detail=unconfirmed))


def _setpoint_due(control: Control, vehicle: VehicleState) -> Step:
    if not control.is_commanded:
        return control, (_A.SEND_SETPOINT,) if control.state in SENDING else ()
    if control.state is not _S.ACTIVE or control.hold_is_pending:
        return control, ()  # a command now would be cancelled by the Hold that is still pending
    if acts := who_acts(vehicle):  # observed while leaving, which failed
        return _end(control, LeaseChange.REVOKED, acts)
    return control, (_A.SEND_COMMAND,)
