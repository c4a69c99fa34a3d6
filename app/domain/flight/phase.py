"""The phase of a run in flight, from what is observed of its vehicle: a table whose first row that fits counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from app.domain.flight.landing import RETURNS
from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import HOLDS, RunAction, RunState
from app.domain.vehicle.state import AIRBORNE, FlightMode, LandedState, VehicleState, VehicleType

STOPPED_M_S = 0.3
DRIVES_M_S = 1.0
AGREED_S: Final = 2.0
"""HEARTBEAT, EXTENDED_SYS_STATE and GLOBAL_POSITION_INT must agree for this time before a flight counts as ended.

HEARTBEAT has a rate of 1 Hz, so at least two of them agree.
"""
ALONE_S: Final = 30.0
"""After this time HEARTBEAT alone is sufficient: some vehicles do not report whether they are on the ground, or are
on a deck.
"""
_OFFBOARD_REASONS: Final = frozenset(
    {ReasonCode.OFFBOARD, ReasonCode.AFTER_OFFBOARD, ReasonCode.AFTER_OFFBOARD_FAILSAFE}
)
_FAILSAFES: Final = frozenset({ReasonCode.FAILSAFE, ReasonCode.FAILSAFE_MODE})
_THROUGH_HOLD: Final = {
    RunAction.RETURN: ReasonCode.RETURNING_AS_ASKED,
    RunAction.LAND: ReasonCode.LANDING_AS_ASKED,
    RunAction.CONTINGENCY: ReasonCode.RETURNING_AFTER_FAILED_DROP,
}
"""A vehicle leaves OFFBOARD through Hold mode before it lands."""
_COMES_DOWN: Final = frozenset(_THROUGH_HOLD)


@dataclass(frozen=True, slots=True)
class PhaseFacts:
    """The facts that determine the phase of a run.

    `commanded`: see Run; `is_unobeyed`: the vehicle has not entered its mode. `pending` is the command that is being
    sent. `was_armed` is False while a HEARTBEAT that reports armed may still be in transit (1 Hz). `asks_consent_to` is
    the drop that waits for an operator, `rally_point` the number (from 1) of the destination of a return,
    `was_returning` and `was_landed` whether the run was in that state at the last observation, `paused_for` the reason
    of a run that was paused then. `is_down` and `is_on_mission`: see Flight. `returns_at_end`: the mission's last item
    is a return. `carries_other`: another client has replaced the mission. `lost_mission_for`: why the autopilot has
    dropped it. `home_moved`: that somebody moved home in flight. `cancelled_failsafe`: see Flight. `after_offboard`:
    offboard control was active since the last command. For `mode_is_settled` and `by_failsafe` see ModeTracker.
    """

    state: VehicleState
    vehicle_type: VehicleType
    at_drop: bool
    mission_done: bool
    was_airborne: bool
    commanded: RunAction | None
    was_armed: bool = True
    pending: RunAction | None = None
    asks_consent_to: str = ""
    rally_point: int | None = None
    was_returning: bool = False
    was_landed: bool = False
    paused_for: Reason | None = None
    is_down: bool = False
    is_on_mission: bool = False
    returns_at_end: bool = False
    is_unobeyed: bool = False
    after_offboard: bool = False
    at_last_item: bool = False
    mode_is_settled: bool = True
    by_failsafe: bool = False
    is_left_at_start: bool = False
    carries_other: bool = False
    lost_mission_for: Reason | None = None
    home_moved: Reason | None = None
    cancelled_failsafe: Reason | None = None

    @property
    def in_failsafe(self) -> bool:
        """Whether a failsafe entered this mode, as far as known."""
        return self.state.in_failsafe or self.by_failsafe

    @property
    def on_ground(self) -> bool:
        """Whether the vehicle reports that it is on the ground."""
        return self.state.landed is LandedState.ON_GROUND

    @property
    def has_stopped(self) -> bool:
        """Of a vehicle that drives."""
        speed_m_s, durations = self.state.ground_speed_m_s, self.state.durations
        stands = durations is None or durations.at_rest_s >= AGREED_S
        return stands and speed_m_s is not None and speed_m_s < STOPPED_M_S

    @property
    def holds(self) -> bool:
        """Whether more than one HEARTBEAT reports Hold mode."""
        is_sure = self.state.durations is None or self.mode_is_settled
        return is_sure and self.state.mode is FlightMode.HOLD

    @property
    def has_driven_to_end(self) -> bool:
        """Whether it is a rover whose plan ends where it drove last. One that returns at the end is disarmed by PX4."""
        return self.vehicle_type is VehicleType.ROVER and self.mission_done and not self.returns_at_end

    @property
    def stands_at_end(self) -> bool:
        """Whether it has stopped there; from then on its speed need not be as steady."""
        speed_m_s = self.state.ground_speed_m_s
        is_still = self.was_landed and (speed_m_s is None or speed_m_s < DRIVES_M_S)
        return self.has_driven_to_end and (self.has_stopped or is_still)

    @property
    def is_left_armed(self) -> bool:
        """Whether it stands armed at its end, where PX4 does not disarm it, and was taken by nobody that it shows."""
        is_ours = self.is_on_mission and not self.in_failsafe and self.commanded in _NOT_HELD
        return self.has_driven_to_end and self.has_stopped and is_ours and self.state.armed is True

    @property
    def stands_amid_return(self) -> bool:
        """Whether it holds on its return at the end of the mission."""
        return self.returns_at_end and self.state.mode is FlightMode.HOLD

    @property
    def is_kept_from_return(self) -> bool:
        """Whether it holds although its return is due. PX4 may show Hold mode for a moment before that begins."""
        has_begun = self.was_returning or self.paused_for is not None
        return self.stands_amid_return and (has_begun or self.mode_is_settled)

    @property
    def stops_to_land(self) -> bool:
        """Whether it is a rover, which stops in Hold mode before it is landed by command."""
        return self.vehicle_type is VehicleType.ROVER and self.pending is RunAction.LAND

    @property
    def comes_down(self) -> bool:
        """Whether the flight is to end, as planned or as commanded."""
        return self.mission_done or self.commanded in _COMES_DOWN


Because = Callable[[PhaseFacts], Reason | None]
_ANY: Final = frozenset({*FlightMode, None})
_ON_MISSION: Final = frozenset({FlightMode.MISSION, FlightMode.TAKEOFF})
_NOT_HELD: Final = frozenset({None, RunAction.RESUME})
"""A person who has paused it at its end keeps it."""


@dataclass(frozen=True, slots=True)
class PhaseRow:
    """One row: in these modes, and if `when` is true, the run is in `state` with `reason`."""

    modes: frozenset[FlightMode | None]
    when: Callable[[PhaseFacts], bool]
    state: RunState
    reason: Because


def _in(*modes: FlightMode) -> frozenset[FlightMode | None]:
    return frozenset(modes)


def _always(_: PhaseFacts) -> bool:
    return True


def _because(code: ReasonCode) -> Because:
    return lambda _: Reason.of(code)


def _no_reason(_: PhaseFacts) -> None:
    return None


def _why_at_drop(facts: PhaseFacts) -> Reason | None:
    if not facts.asks_consent_to:
        return facts.home_moved
    return Reason.of(ReasonCode.WAITS_FOR_CONSENT, plan_item_id=facts.asks_consent_to)


def _why_through_hold(facts: PhaseFacts) -> Reason | None:
    return None if facts.pending is None else Reason.of(_THROUGH_HOLD[facts.pending])


def _why_paused(facts: PhaseFacts) -> Reason:
    """The pause for offboard control was commanded; resuming after it was not."""
    if not facts.after_offboard:
        by_plan = facts.commanded is RunAction.CONTINGENCY_HOLD
        if facts.cancelled_failsafe is not None and not by_plan:
            return Reason.of(ReasonCode.PAUSED_AMID_FAILSAFE, facts.cancelled_failsafe)
        return Reason.of(ReasonCode.HOLDING_AFTER_FAILED_DROP if by_plan else ReasonCode.PAUSED_AS_ASKED)
    return Reason.of(ReasonCode.AFTER_OFFBOARD_FAILSAFE if facts.state.in_failsafe else ReasonCode.AFTER_OFFBOARD)


def _why_landing(facts: PhaseFacts) -> Reason:
    if facts.commanded is RunAction.LAND:
        return Reason.of(ReasonCode.LANDING_AS_ASKED)
    if facts.in_failsafe:
        return Reason.of(ReasonCode.FAILSAFE_MODE, mode=FlightMode.LAND.value)
    is_by_others = facts.mode_is_settled and not facts.is_unobeyed
    return Reason.of(ReasonCode.LAND_BY_OTHERS if is_by_others else ReasonCode.VEHICLE_LANDS)


def _why_stopped(facts: PhaseFacts) -> Reason:
    if facts.carries_other and not facts.in_failsafe and facts.state.mode is FlightMode.HOLD:
        return Reason.of(ReasonCode.OTHER_MISSION_ON_BOARD)
    if facts.lost_mission_for is not None and not facts.in_failsafe and facts.state.mode is FlightMode.HOLD:
        return facts.lost_mission_for
    code = ReasonCode.TAKEN_BY_OTHERS if facts.mode_is_settled else ReasonCode.NOT_IN_MISSION
    code = ReasonCode.FAILSAFE_MODE if facts.in_failsafe else code
    return Reason.of(code, mode=facts.state.mode.value if facts.state.mode is not None else "an unknown")


def _why_paused_on_ground(facts: PhaseFacts) -> Reason | None:
    is_asked = facts.commanded in HOLDS and facts.state.mode is FlightMode.HOLD
    return _why_paused(facts) if is_asked else facts.paused_for


def _because_of_failsafe_mode(facts: PhaseFacts) -> Reason:
    """PX4 alone descends: nobody can command it."""
    assert facts.state.mode is not None
    return Reason.of(ReasonCode.FAILSAFE_MODE, mode=facts.state.mode.value)


def _why_returning(facts: PhaseFacts) -> Reason | None:
    if facts.commanded is RunAction.RETURN and facts.rally_point is not None:
        return Reason.of(ReasonCode.RETURNING_TO_RALLY_POINT, rally_point=facts.rally_point)
    if facts.commanded is RunAction.RETURN:
        return Reason.of(ReasonCode.RETURNING_AS_ASKED)
    if facts.commanded is RunAction.CONTINGENCY:
        return Reason.of(ReasonCode.RETURNING_AFTER_FAILED_DROP)
    if facts.mission_done:
        return Reason.of(ReasonCode.MISSION_DONE)
    if facts.in_failsafe:
        return Reason.of(ReasonCode.FAILSAFE)
    is_by_others = facts.mode_is_settled and not facts.is_unobeyed  # else it may be what was commanded before
    return Reason.of(ReasonCode.RETURN_BY_OTHERS) if is_by_others else None


_HOLD: Final = _in(FlightMode.HOLD)
_NOT_DOWN: Final = _ANY - {FlightMode.RETURN, FlightMode.LAND, FlightMode.DESCEND}
_S = RunState
PHASES: Final[tuple[PhaseRow, ...]] = (
    # disarmed: landed, once a HEARTBEAT has had time to say armed
    PhaseRow(_ANY, lambda f: f.state.armed is False and not f.was_armed, _S.FLYING, _no_reason),
    PhaseRow(_ANY, lambda f: f.state.armed is False and (f.was_airborne or f.mission_done), _S.LANDED, _no_reason),
    PhaseRow(_ANY, lambda f: f.state.armed is False, _S.LANDED, _because(ReasonCode.DISARMED_BEFORE_TAKEOFF)),
    # armed at their end: what drives stops there, an airship holds there
    PhaseRow(_ANY, lambda f: f.stands_at_end, _S.LANDED, _because(ReasonCode.STOPPED_AT_LAST_ITEM)),
    PhaseRow(
        _HOLD,
        lambda f: f.vehicle_type is VehicleType.AIRSHIP and f.mission_done and f.holds and not f.stands_amid_return,
        _S.LANDED,
        _because(ReasonCode.HOLDS_AT_LAST_ITEM),
    ),
    PhaseRow(_ANY, lambda f: f.state.is_terminated, _S.RETURNING, _because(ReasonCode.TERMINATED)),
    # landed, and not by the mission: as it disarms PX4 goes back to the mode before, and says so one by one
    PhaseRow(_NOT_DOWN, lambda f: f.was_returning and f.is_down, _S.RETURNING, _because(ReasonCode.ON_GROUND)),
    PhaseRow(_NOT_DOWN, lambda f: f.paused_for is not None and f.is_down, _S.PAUSED, _why_paused_on_ground),
    PhaseRow(
        _in(FlightMode.MISSION), lambda f: f.was_returning and f.on_ground, _S.RETURNING, _because(ReasonCode.ON_GROUND)
    ),
    PhaseRow(_ON_MISSION, lambda f: f.carries_other, _S.PAUSED, _because(ReasonCode.OTHER_MISSION_ON_BOARD)),
    PhaseRow(_ON_MISSION, lambda f: f.at_drop, _S.AT_DROP, _why_at_drop),
    PhaseRow(_ON_MISSION, _always, _S.FLYING, lambda f: f.home_moved),
    PhaseRow(_in(FlightMode.RETURN), _always, _S.RETURNING, _why_returning),
    PhaseRow(_in(FlightMode.LAND), _always, _S.RETURNING, _why_landing),
    PhaseRow(_in(FlightMode.DESCEND), _always, _S.RETURNING, _because_of_failsafe_mode),
    # Hold: left at a start that a restart of the service broke off, before another mode, or as commanded
    PhaseRow(
        _HOLD,
        lambda f: f.is_left_at_start and (f.vehicle_type is VehicleType.ROVER or not f.was_airborne),
        _S.FLYING,
        _because(ReasonCode.RESTART_DURING_START_ARMED),
    ),
    PhaseRow(_HOLD, lambda f: f.stops_to_land, _S.RETURNING, _because(ReasonCode.LANDING_AS_ASKED)),
    PhaseRow(_HOLD, lambda f: f.pending in _THROUGH_HOLD, _S.PAUSED, _why_through_hold),
    PhaseRow(_HOLD, lambda f: f.commanded is RunAction.RESUME, _S.PAUSED, _because(ReasonCode.RESUMING_AS_ASKED)),
    PhaseRow(_HOLD, lambda f: f.commanded is RunAction.REFUSED, _S.PAUSED, _because(ReasonCode.CHANGE_REFUSED)),
    PhaseRow(_HOLD, lambda f: f.commanded in HOLDS, _S.PAUSED, _why_paused),
    # PX4 leaves Return mode as it disarms, and says so one by one
    PhaseRow(_HOLD, lambda f: f.comes_down and f.on_ground, _S.RETURNING, _because(ReasonCode.ON_GROUND)),
    PhaseRow(
        _HOLD,
        lambda f: f.mission_done and not f.is_kept_from_return and (f.mode_is_settled or not f.returns_at_end),
        _S.FLYING,
        _because(ReasonCode.HOLDS_WHERE_IT_ENDED),
    ),
    # the completion of the mission may follow
    PhaseRow(
        _HOLD,
        lambda f: f.at_last_item and not (f.mode_is_settled or f.in_failsafe or f.is_kept_from_return),
        _S.FLYING,
        _no_reason,
    ),
    PhaseRow(_in(FlightMode.OFFBOARD), _always, _S.PAUSED, _because(ReasonCode.OFFBOARD)),
    PhaseRow(_ANY, _always, _S.PAUSED, _why_stopped),
)
"""The first row that matches counts. The last one always matches: somebody else, or a failsafe, controls the
vehicle.
"""


def phase_of(facts: PhaseFacts) -> tuple[RunState, Reason | None]:
    """The run's state and the reason to show with it. Only for a connected vehicle whose run has started."""
    phase = next(row for row in PHASES if facts.state.mode in row.modes and row.when(facts))
    return phase.state, phase.reason(facts)


def final_state(
    *,
    mission_done: bool,
    commanded: RunAction | None,
    reason: Reason | None,
    returns_at_end: bool = False,
    lands_at_end: bool = False,
    elsewhere: Reason | None = None,
    fallen: Reason | None = None,
    landed_for: Reason | None = None,
) -> tuple[RunState, Reason | None]:
    """The last state of a run whose vehicle has landed and disarmed (or stopped, a rover; or holds, an airship).

    `returns_at_end`, `lands_at_end`: a landing, or a return, that is commanded on the way is not the mission's end,
    although its items are done: PX4 reports a landing item as reached when it begins. `elsewhere`: see
    Touchdown.why_elsewhere; `fallen`: see Touchdown.why_fallen; `landed_for`: the reason with which it came down.
    """
    if fallen is not None:  # whatever was commanded: somebody must look after it
        return RunState.FAILED, fallen
    returned = commanded in RETURNS
    is_interrupted = (returns_at_end and commanded is RunAction.LAND) or (lands_at_end and returned)
    if mission_done and elsewhere is None and not is_interrupted:  # done before anything was commanded
        return RunState.COMPLETED, reason
    if elsewhere is not None and commanded is not RunAction.LAND:
        return RunState.ABORTED if returned else RunState.FAILED, elsewhere
    if commanded in (RunAction.RETURN, RunAction.LAND):
        return RunState.ABORTED, Reason.of(ReasonCode.ASKED_BEFORE_DONE, asked=commanded.value)
    if commanded is RunAction.CONTINGENCY:
        return RunState.ABORTED, Reason.of(ReasonCode.RETURNED_AFTER_FAILED_DROP)
    early = ReasonCode.ENDED_EARLY if landed_for is None else ReasonCode.ENDED_EARLY_BECAUSE
    return RunState.FAILED, reason or Reason.of(early, landed_for)


def reason_left_open(last: RunState, reason: Reason | None) -> Reason:
    """Why a drop that was open until then ends with its run: a run that was completed has no reason of its own."""
    if reason is not None:
        return reason
    if last is RunState.COMPLETED:
        return Reason.of(ReasonCode.FLOWN_TO_END)
    return Reason.of(ReasonCode.RUN_ENDED, state=last.value)


def is_offboard_reason(reason: Reason | None) -> bool:
    """Whether the reason says that the vehicle is or was under offboard control."""
    return reason is not None and reason.code in _OFFBOARD_REASONS


def failsafe_of(reason: Reason | None) -> Reason | None:
    """The failsafe that a run names, active or cancelled by its pause; None if it names none."""
    if reason is not None and reason.code is ReasonCode.PAUSED_AMID_FAILSAFE:
        return reason.cause
    return reason if reason is not None and reason.code in _FAILSAFES else None


def is_airborne(state: VehicleState) -> bool:
    """Whether it left the ground. A rover counts when it reports so."""
    return state.landed in AIRBORNE


def stands_disarmed(state: VehicleState) -> bool:
    """Whether it says that it is disarmed and on the ground."""
    return state.connected and state.armed is False and state.landed is LandedState.ON_GROUND


def is_landing_unsure(state: VehicleState) -> bool:
    """Whether a vehicle that says disarmed may still fly: one message can be forged, or of another vehicle."""
    durations = state.durations
    if state.armed is not False or durations is None:
        return False
    agree = min(durations.disarmed_s, durations.on_ground_s, durations.at_rest_s) >= AGREED_S
    return not agree and durations.disarmed_s < ALONE_S
