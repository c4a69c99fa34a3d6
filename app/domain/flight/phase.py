"""The state of a run in flight, derived from the observed vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.reasons import Reason, ReasonCode
from app.domain.run.run import Asked, RunState
from app.domain.vehicle.state import FlightMode, LandedState, VehicleState, VehicleType

STOPPED_M_S = 0.3
_OFFBOARD_REASONS: Final = frozenset(
    {ReasonCode.OFFBOARD, ReasonCode.AFTER_OFFBOARD, ReasonCode.AFTER_OFFBOARD_FAILSAFE}
)
_THROUGH_HOLD: Final = {
    Asked.RETURN: ReasonCode.RETURNING_AS_ASKED,
    Asked.LAND: ReasonCode.LANDING_AS_ASKED,
    Asked.CONTINGENCY: ReasonCode.RETURNING_AFTER_FAILED_DROP,
}
"""From OFFBOARD, a vehicle returns or lands by way of Hold."""


@dataclass(frozen=True, slots=True)
class FlightView:
    """`asked`: see Run. `command` is the pending command. `was_armed` is False while a HEARTBEAT that reports arming
    may still be on its way (1 Hz). `asks_consent_to` is the drop with a pending consent request, `rally_point` the
    number (from 1) of the destination of "return", `was_returning` whether the run was returning at the last
    observation. `after_offboard`: offboard control was active since the last request. For `mode_is_settled` and
    `by_failsafe` see ModeSign.
    """

    state: VehicleState
    vehicle_type: VehicleType
    at_drop: bool
    mission_done: bool
    was_airborne: bool
    asked: Asked | None
    was_armed: bool = True
    command: Asked | None = None
    asks_consent_to: str = ""
    rally_point: int | None = None
    was_returning: bool = False
    after_offboard: bool = False
    at_last_item: bool = False
    mode_is_settled: bool = True
    by_failsafe: bool = False

    @property
    def in_failsafe(self) -> bool:
        """Whether a failsafe entered this mode, as far as known."""
        return self.state.in_failsafe or self.by_failsafe


def phase_of(view: FlightView) -> tuple[RunState, Reason | None]:
    """Return the state of the run and its reason. Only for a connected vehicle whose run has started."""
    state = view.state
    if state.armed is False and not view.was_armed:
        return RunState.FLYING, None
    if state.armed is False:
        return RunState.LANDED, None if view.was_airborne else Reason.of(ReasonCode.DISARMED_BEFORE_TAKEOFF)
    if view.vehicle_type is VehicleType.ROVER and view.mission_done and _has_stopped(state):
        return RunState.LANDED, Reason.of(ReasonCode.STOPPED_AT_LAST_ITEM)
    if view.vehicle_type is VehicleType.AIRSHIP and view.mission_done and state.mode is FlightMode.HOLD:
        return RunState.LANDED, Reason.of(ReasonCode.HOLDS_AT_LAST_ITEM)
    if state.mode is FlightMode.MISSION and view.was_returning and state.landed is LandedState.ON_GROUND:
        # PX4 may be in Mission mode for a moment before it disarms
        return RunState.RETURNING, Reason.of(ReasonCode.ON_GROUND)
    if state.mode in (FlightMode.MISSION, FlightMode.TAKEOFF):
        return (RunState.AT_DROP, _why_at_drop(view)) if view.at_drop else (RunState.FLYING, None)
    if state.mode is FlightMode.RETURN:
        return RunState.RETURNING, _why_returning(view)
    if state.mode is FlightMode.LAND:
        as_asked = view.asked is Asked.LAND
        return RunState.RETURNING, Reason.of(ReasonCode.LANDING_AS_ASKED if as_asked else ReasonCode.VEHICLE_LANDS)
    if state.mode is FlightMode.HOLD:
        return _phase_in_hold(view)
    if state.mode is FlightMode.OFFBOARD:
        return RunState.PAUSED, Reason.of(ReasonCode.OFFBOARD)
    return RunState.PAUSED, _why_stopped(view)


def _phase_in_hold(view: FlightView) -> tuple[RunState, Reason | None]:
    if view.command in _THROUGH_HOLD:
        return RunState.PAUSED, Reason.of(_THROUGH_HOLD[view.command])
    if view.asked is Asked.RESUME:
        return RunState.PAUSED, Reason.of(ReasonCode.RESUMING_AS_ASKED)
    if view.asked is Asked.REFUSED:
        return RunState.PAUSED, Reason.of(ReasonCode.CHANGE_REFUSED)
    if view.asked is Asked.PAUSE:
        return RunState.PAUSED, _why_paused(view)
    is_ending = view.mission_done or view.asked in (Asked.RETURN, Asked.LAND, Asked.CONTINGENCY)
    if is_ending and view.state.landed is LandedState.ON_GROUND:
        # PX4 leaves Return mode while disarming, and reports the two separately
        return RunState.RETURNING, Reason.of(ReasonCode.ON_GROUND)
    if view.mission_done:
        return RunState.FLYING, Reason.of(ReasonCode.HOLDS_WHERE_IT_ENDED)
    if view.at_last_item and not (view.mode_is_settled or view.in_failsafe):
        return RunState.FLYING, None  # it may be about to report that the mission is complete
    return RunState.PAUSED, _why_stopped(view)


def how_it_ended(*, mission_done: bool, asked: Asked | None, reason: Reason | None) -> tuple[RunState, Reason | None]:
    """Return the final state of a run whose vehicle has landed and disarmed (or stopped, a rover; or holds, an
    airship).
    """
    if mission_done:  # complete only if nothing else was requested before
        return RunState.COMPLETED, reason
    if asked in (Asked.RETURN, Asked.LAND):
        return RunState.ABORTED, Reason.of(ReasonCode.ASKED_BEFORE_DONE, asked=asked.value)
    if asked is Asked.CONTINGENCY:
        return RunState.ABORTED, Reason.of(ReasonCode.RETURNED_AFTER_FAILED_DROP)
    return RunState.FAILED, reason or Reason.of(ReasonCode.ENDED_EARLY)


def why_open(last: RunState, reason: Reason | None) -> Reason:
    """Return the reason of a drop that ends with its run. A completed run has no reason of its own."""
    if reason is not None:
        return reason
    if last is RunState.COMPLETED:
        return Reason.of(ReasonCode.FLOWN_TO_END)
    return Reason.of(ReasonCode.RUN_ENDED, state=last.value)


def is_offboard_reason(reason: Reason | None) -> bool:
    """Whether the reason says that the vehicle is or was under offboard control."""
    return reason is not None and reason.code in _OFFBOARD_REASONS


def is_airborne(state: VehicleState) -> bool:
    """Whether it left the ground. A rover counts when it reports so, 0.6 s after arming (recording 25)."""
    return state.landed in (LandedState.IN_AIR, LandedState.TAKING_OFF, LandedState.LANDING)


def _has_stopped(state: VehicleState) -> bool:
    return state.ground_speed_m_s is not None and state.ground_speed_m_s < STOPPED_M_S


def _why_at_drop(view: FlightView) -> Reason | None:
    if not view.asks_consent_to:
        return None
    return Reason.of(ReasonCode.WAITS_FOR_CONSENT, plan_item_id=view.asks_consent_to)


def _why_paused(view: FlightView) -> Reason:
    """The pause for entering offboard control was requested. That it continues afterwards was not."""
    if not view.after_offboard:
        return Reason.of(ReasonCode.PAUSED_AS_ASKED)
    return Reason.of(ReasonCode.AFTER_OFFBOARD_FAILSAFE if view.state.in_failsafe else ReasonCode.AFTER_OFFBOARD)


def _why_stopped(view: FlightView) -> Reason:
    code = ReasonCode.TAKEN_BY_OTHERS if view.mode_is_settled else ReasonCode.NOT_IN_MISSION
    code = ReasonCode.FAILSAFE_MODE if view.in_failsafe else code
    return Reason.of(code, mode=view.state.mode.value if view.state.mode is not None else "an unknown")


def _why_returning(view: FlightView) -> Reason | None:
    if view.asked is Asked.RETURN and view.rally_point is not None:
        return Reason.of(ReasonCode.RETURNING_TO_RALLY_POINT, rally_point=view.rally_point)
    if view.asked is Asked.RETURN:
        return Reason.of(ReasonCode.RETURNING_AS_ASKED)
    if view.asked is Asked.CONTINGENCY:
        return Reason.of(ReasonCode.RETURNING_AFTER_FAILED_DROP)
    if view.mission_done:
        return Reason.of(ReasonCode.MISSION_DONE)
    if view.in_failsafe:
        return Reason.of(ReasonCode.FAILSAFE)
    return Reason.of(ReasonCode.RETURN_BY_OTHERS) if view.mode_is_settled else None
