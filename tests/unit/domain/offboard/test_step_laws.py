"""Laws of the states of offboard control, over any inputs in any order."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from app.domain.errors import WaydropError
from app.domain.offboard.control_method import ControlMethod
from app.domain.offboard.inputs import (
    AcquireLease,
    ControlAction,
    Effect,
    EndLease,
    Enter,
    EntryFailed,
    EntryProgressed,
    HoldAnswered,
    Input,
    Leave,
    LeavingFailed,
    LinkFactReceived,
    OfferLease,
    RecordLease,
    RecordState,
    RenewLease,
    SetpointDue,
    StartStream,
    Tick,
    UserCommanded,
)
from app.domain.offboard.state import (
    COMMANDED,
    ENTERING,
    MAY_BE_IN,
    SENDING,
    TRANSITIONS,
    Control,
    Lease,
    LeaseChange,
    OffboardState,
    who_acts,
)
from app.domain.offboard.step import step
from app.domain.reasons import Reason, ReasonCode
from app.domain.vehicle.facts import DuplicateSystem, LinkLost, Rebooted, StateChanged
from app.domain.vehicle.state import FlightMode, VehicleState

_S = OffboardState
STOPS = Reason.of(ReasonCode.OFFBOARD_SERVICE_STOPS)
WAY_IN = (_S.CHECKING, _S.HOLDING, _S.STREAMING, _S.SWITCHING, _S.ACTIVE)
IDS = st.sampled_from(["a", "b", "c"])
HOLDERS = st.sampled_from(["ann", "ben"])
ENDS = st.sampled_from([change for change in LeaseChange if change.ends])
TO = st.sampled_from(["hold", "mission", "return"])
METHODS = st.sampled_from(ControlMethod)
MODES = st.sampled_from(
    [None, FlightMode.HOLD, FlightMode.OFFBOARD, FlightMode.RETURN, FlightMode.LAND, FlightMode.MISSION]
)
NEW_LEASES = st.builds(Lease, IDS, st.just("v1"), HOLDERS, st.just(10.0))
ANY = st.one_of(
    st.builds(AcquireLease, NEW_LEASES, st.just(20.0), METHODS, st.booleans()),
    st.builds(RenewLease, IDS),
    st.builds(OfferLease, IDS, st.none() | HOLDERS),
    st.builds(EndLease, ENDS, st.just(STOPS), st.booleans()),
    st.builds(Enter, st.none() | METHODS, st.none() | METHODS),
    st.builds(EntryProgressed, st.sampled_from(WAY_IN)),
    st.builds(EntryFailed, st.just(Reason.of(ReasonCode.OFFBOARD_ENTRY_BROKEN_OFF))),
    st.builds(Leave, TO),
    st.builds(LeavingFailed, TO),
    st.builds(UserCommanded, st.sampled_from(["", "hold", "return", "land"])),
    st.builds(
        LinkFactReceived,
        st.sampled_from(
            [StateChanged(), LinkLost(10.0), Rebooted(), DuplicateSystem(Reason.of(ReasonCode.TWO_CLOCKS))]
        ),
    ),
    st.builds(HoldAnswered, st.sampled_from(["", "no answer"])),
    st.builds(Tick),
    st.builds(SetpointDue),
)
VEHICLES = st.builds(VehicleState, mode=MODES, armed=st.booleans(), in_failsafe=st.booleans())
INPUTS = st.lists(st.tuples(ANY, st.floats(0.0, 6.0), VEHICLES), max_size=40)
Seen = tuple[Control, Input, Control, tuple[Effect, ...]]


def begun(state: OffboardState, control_method: ControlMethod) -> Control:
    """One with a lease, in any state."""
    lease = None if state is OffboardState.IDLE else Lease("a", "v1", "ann", 10.0)
    return Control("v1", 10.0, state, lease=lease, control_method=control_method)


def all_seen(control: Control, inputs: list[tuple[object, float, VehicleState]]) -> list[Seen]:
    """Each step that was not refused: before, input, after, effects."""
    seen, now_s = [], 0.0
    for content, later_s, vehicle in inputs:
        now_s += later_s
        if isinstance(content, RenewLease | OfferLease) and control.lease is not None and content.lease_id != "c":
            content = replace(content, lease_id=control.lease.id)
        if isinstance(content, AcquireLease):
            content = replace(
                content, lease=replace(content.lease, id=f"{content.lease.id}{len(seen)}", expires_s=now_s + 10.0)
            )
        happened = Input(content, now_s, vehicle)  # type: ignore[arg-type]
        try:
            after, effects = step(control, happened)
        except WaydropError:
            continue
        seen.append((control, happened, after, effects))
        control = after
    return seen


RUNS = st.builds(all_seen, st.builds(begun, st.sampled_from(OffboardState), METHODS), INPUTS)


def lease_changes(effects: tuple[Effect, ...], change: LeaseChange | None = None) -> list[RecordLease]:
    """What is recorded of the lease."""
    leases = [effect for effect in effects if isinstance(effect, RecordLease)]
    return [lease for lease in leases if change is None or lease.change is change]


@given(RUNS)
def test_each_change_of_state_is_in_the_table(run: list[Seen]) -> None:
    for before, _input, after, effects in run:
        state = before.state
        for effect in effects:
            if isinstance(effect, RecordState):
                assert effect.state in TRANSITIONS[state] | {state}
                state = effect.state
        assert state is after.state


@given(RUNS)
def test_nothing_leaves_without_a_lease_in_a_state_that_sends(run: list[Seen]) -> None:
    for before, _input, after, effects in run:
        if ControlAction.SEND_SETPOINT in effects:
            assert before.lease is not None
            assert before.state in SENDING
            assert after.control_method is ControlMethod.SETPOINTS
        if ControlAction.SEND_COMMAND in effects:
            assert (before.lease is not None, before.state, before.control_method) == (
                True,
                OffboardState.ACTIVE,
                ControlMethod.COMMANDS,
            )
        assert (after.lease is None) == (after.state is OffboardState.IDLE)


@given(RUNS)
def test_after_the_end_only_a_new_lease_or_the_answer_of_hold_has_an_effect(run: list[Seen]) -> None:
    for before, control_input, after, effects in run:
        if before.state is OffboardState.IDLE and not isinstance(control_input.content, AcquireLease):
            assert after.state is OffboardState.IDLE
            assert not lease_changes(effects)
            assert not {effect for effect in effects if isinstance(effect, ControlAction)} - {
                ControlAction.CANCEL_HOLD,
                ControlAction.NOTIFY,
            }
            if isinstance(control_input.content, HoldAnswered) and effects:
                assert after.reason is not None
                assert after.reason.cause == before.reason


@given(RUNS)
def test_a_lease_that_is_gone_is_never_given_back(run: list[Seen]) -> None:
    gone: set[str] = set()
    for before, _input, after, effects in run:
        if before.lease is not None and (after.lease is None or after.lease.id != before.lease.id):
            gone.add(before.lease.id)
            assert lease_changes(effects), "the loss is recorded"
        assert after.lease is None or after.lease.id not in gone


@given(RUNS)
def test_a_lease_that_is_over_is_neither_renewed_nor_used(run: list[Seen]) -> None:
    for before, control_input, after, _effects in run:
        if before.lease is not None and control_input.now_s >= before.lease.expires_s:
            assert not isinstance(control_input.content, RenewLease | OfferLease)
            if isinstance(control_input.content, Tick | AcquireLease):
                assert after.lease is None or after.lease.id != before.lease.id


@given(RUNS)
def test_a_mode_that_somebody_else_commanded_is_never_fought(run: list[Seen]) -> None:
    for before, control_input, after, effects in run:
        others = who_acts(control_input.vehicle) and control_input.vehicle.mode is not FlightMode.OFFBOARD
        if not others or not isinstance(control_input.content, LinkFactReceived):
            continue
        assert not {ControlAction.COMMAND_HOLD, ControlAction.SEND_SETPOINT, ControlAction.SEND_COMMAND} & {
            effect for effect in effects if isinstance(effect, ControlAction)
        }
        assert not after.hold_is_pending
        if before.state in (OffboardState.STREAMING, OffboardState.SWITCHING, OffboardState.ACTIVE) and (
            control_input.vehicle.mode not in (FlightMode.HOLD, None)
        ):
            assert after.state is OffboardState.IDLE


@given(RUNS)
def test_hold_is_commanded_only_to_a_vehicle_that_follows_us(run: list[Seen]) -> None:
    for before, control_input, after, effects in run:
        if ControlAction.COMMAND_HOLD not in effects:
            continue
        assert after.hold_is_pending
        if isinstance(control_input.content, AcquireLease) and lease_changes(effects, LeaseChange.EXPIRED) == []:
            assert before.is_commanded or before.state is OffboardState.SWITCHING, "flown by the one before until then"
            continue
        ours = FlightMode.HOLD if before.is_commanded else FlightMode.OFFBOARD
        assert before.state is OffboardState.SWITCHING or control_input.vehicle.mode in (ours, None)


@given(RUNS)
def test_the_same_inputs_give_the_same_effects(run: list[Seen]) -> None:
    for before, control_input, after, effects in run:
        assert step(before, control_input) == (after, effects)


@given(RUNS)
def test_each_change_is_recorded_and_notified(run: list[Seen]) -> None:
    for before, _input, after, effects in run:
        recorded = [effect for effect in effects if isinstance(effect, RecordLease | RecordState)]
        changes = [effect for effect in recorded if isinstance(effect, RecordState)]
        if (before.state, before.reason) != (after.state, after.reason):
            last = changes[-1]
            assert (last.state, last.holder, last.reason) == (after.state, after.holder, after.reason)
        if recorded:
            assert ControlAction.NOTIFY in effects
        assert len([effect for effect in effects if isinstance(effect, StartStream)]) == len(
            lease_changes(effects, LeaseChange.ACQUIRED)
        )


@given(st.sampled_from(OffboardState), METHODS, VEHICLES)
def test_an_end_without_hold_sends_nothing(
    state: OffboardState, control_method: ControlMethod, vehicle: VehicleState
) -> None:
    after, effects = step(
        begun(state, control_method), Input(EndLease(LeaseChange.REVOKED, STOPS, False), 0.0, vehicle)
    )
    assert (after.state, after.lease, after.hold_is_pending) == (OffboardState.IDLE, None, False)
    assert ControlAction.COMMAND_HOLD not in effects
    assert (ControlAction.STOP in effects) == (state is not OffboardState.IDLE)


@given(st.sampled_from([_S.HOLDING, _S.STREAMING, _S.SWITCHING]), st.sampled_from(WAY_IN), METHODS, VEHICLES)
def test_an_entry_goes_on_only_in_the_mode_that_it_expects(
    state: OffboardState, to: OffboardState, control_method: ControlMethod, vehicle: VehicleState
) -> None:
    before = begun(state, control_method)
    after, effects = step(before, Input(EntryProgressed(to), 0.0, vehicle))
    if to not in TRANSITIONS[state]:
        assert after.state is state
    elif vehicle.mode in (COMMANDED if before.is_commanded else MAY_BE_IN[to]):
        assert after.state in (to, OffboardState.IDLE), "disarmed, or in a failsafe, it is not ours either"
    else:
        assert (after.state, after.lease, after.hold_is_pending) == (OffboardState.IDLE, None, False)
        assert ControlAction.STOP in effects
        assert ControlAction.COMMAND_HOLD not in effects, "the mode is somebody else's"


@given(st.sampled_from(OffboardState), METHODS, VEHICLES)
def test_who_takes_a_lease_over_continues_a_flight_and_no_entry(
    state: OffboardState, control_method: ControlMethod, vehicle: VehicleState
) -> None:
    acquired = AcquireLease(Lease("b", "v1", "ben", 10.0), 20.0, control_method, override=True)
    after, effects = step(begun(state, control_method), Input(acquired, 0.0, vehicle))
    is_new = state is OffboardState.IDLE or state in ENTERING
    assert after.state is (OffboardState.LEASED if is_new else state)
    assert (after.holder, ControlAction.STOP_ENTERING_OR_LEAVING in effects) == ("ben", state is not OffboardState.IDLE)
    if state is OffboardState.SWITCHING:
        assert (ControlAction.COMMAND_HOLD in effects, after.hold_is_pending) == (True, True)
