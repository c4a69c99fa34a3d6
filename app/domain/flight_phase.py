"""Which state a run in flight is in, from what is seen of its vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from app.domain.run import Asked, RunState
from app.domain.vehicle import FlightMode, LandedState, VehicleState, VehicleType

STOPPED_M_S = 0.3
_BY_HAND: Final = "flown by hand in offboard mode: the mission waits, and Waydrop drops nothing"
_AFTER_HANDS: Final = "paused after it was flown by hand: the vehicle holds"
_AFTER_HANDS_FAILSAFE: Final = "paused after it was flown by hand: a failsafe acts, and the vehicle holds"

_THROUGH_HOLD: Final = {
    Asked.RETURN: "returning, as asked",
    Asked.LAND: "landing, as asked",
    Asked.CONTINGENCY: "a drop failed: returning, as the plan says",
}
"""A vehicle comes down out of OFFBOARD by way of Hold."""


@dataclass(frozen=True, slots=True)
class FlightView:
    """`asked`: see Run. `command` is what the vehicle is being told now. `was_armed` is False while a HEARTBEAT
    that says armed may still be on its way (they come at 1 Hz). `asks_consent_to` is the drop that waits for an
    operator, `rally_point` the number (from 1) of the one to which "return" goes, `was_returning` whether the run
    was on its way back when it was last looked at. `after_hands`: it was flown by hand since anything was asked
    for. For `mode_is_settled` and `by_failsafe` see ModeSign.
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
    after_hands: bool = False
    at_last_item: bool = False
    mode_is_settled: bool = True
    by_failsafe: bool = False

    @property
    def in_failsafe(self) -> bool:
        """Whether this mode was entered by a failsafe, as far as is known."""
        return self.state.in_failsafe or self.by_failsafe


def phase_of(view: FlightView) -> tuple[RunState, str]:
    """The run's state and the reason to show with it. Only for a connected vehicle whose run has started."""
    state = view.state
    if state.armed is False and not view.was_armed:
        return RunState.FLYING, ""
    if state.armed is False:
        return RunState.LANDED, "" if view.was_airborne else "disarmed before it took off"
    if view.vehicle_type is VehicleType.ROVER and view.mission_done and _has_stopped(state):
        return RunState.LANDED, "stopped at its last item"
    if view.vehicle_type is VehicleType.AIRSHIP and view.mission_done and state.mode is FlightMode.HOLD:
        return RunState.LANDED, "holds at its last item; it says landed only when its crew disarms it"
    if state.mode is FlightMode.MISSION and view.was_returning and state.landed is LandedState.ON_GROUND:
        return RunState.RETURNING, "on the ground"  # PX4 may be in Mission again for a moment before it disarms
    if state.mode in (FlightMode.MISSION, FlightMode.TAKEOFF):
        asks = f"waits for an operator's consent to {view.asks_consent_to}" if view.asks_consent_to else ""
        return (RunState.AT_DROP, asks) if view.at_drop else (RunState.FLYING, "")
    if state.mode is FlightMode.RETURN:
        return RunState.RETURNING, _why_returning(view)
    if state.mode is FlightMode.LAND:
        return RunState.RETURNING, "landing, as asked" if view.asked is Asked.LAND else "the vehicle lands"
    if state.mode is FlightMode.HOLD and view.command in _THROUGH_HOLD:
        return RunState.PAUSED, _THROUGH_HOLD[view.command]
    if state.mode is FlightMode.HOLD and view.asked is Asked.RESUME:
        return RunState.PAUSED, "resuming, as asked"
    if state.mode is FlightMode.HOLD and view.asked is Asked.REFUSED:
        return RunState.PAUSED, "the vehicle refused its changed mission, and holds; resume flies the one before"
    if state.mode is FlightMode.HOLD and view.asked is Asked.PAUSE:
        return RunState.PAUSED, _why_paused(view)
    is_ending = view.mission_done or view.asked in (Asked.RETURN, Asked.LAND, Asked.CONTINGENCY)
    if state.mode is FlightMode.HOLD and is_ending and state.landed is LandedState.ON_GROUND:
        return RunState.RETURNING, "on the ground"  # PX4 leaves Return mode as it disarms, and says so one by one
    if state.mode is FlightMode.HOLD and view.mission_done:
        return RunState.FLYING, "the mission is finished: the vehicle holds where it ended"
    if state.mode is FlightMode.OFFBOARD:
        return RunState.PAUSED, _BY_HAND
    if state.mode is FlightMode.HOLD and view.at_last_item and not (view.mode_is_settled or view.in_failsafe):
        return RunState.FLYING, ""  # it may be about to say that the mission is complete
    return RunState.PAUSED, _why_stopped(view)


def how_it_ended(*, mission_done: bool, asked: Asked | None, reason: str) -> tuple[RunState, str]:
    """The last state of a run whose vehicle has landed and disarmed (or stopped, a rover; or holds, an airship)."""
    if mission_done:  # it counts as done only if nobody had asked for something else before
        return RunState.COMPLETED, reason
    if asked in (Asked.RETURN, Asked.LAND):
        return RunState.ABORTED, f"asked to {asked.value} before the mission was done"
    if asked is Asked.CONTINGENCY:
        return RunState.ABORTED, "a drop failed: the vehicle returned, as the plan says"
    return RunState.FAILED, reason or "the vehicle ended its flight before the mission was done"


def why_open(last: RunState, reason: str) -> str:
    """Why a drop that was open until then ends with its run: a run that was completed has no reason of its own."""
    return reason or ("the mission was flown to its end" if last is RunState.COMPLETED else last.value)


def is_of_hands(reason: str) -> bool:
    """Whether a run's reason says that its vehicle is, or was until then, flown by hand."""
    return reason in (_BY_HAND, _AFTER_HANDS, _AFTER_HANDS_FAILSAFE)


def is_airborne(state: VehicleState) -> bool:
    """Whether it left the ground. A rover counts when it says so, 0.6 s after arming (px4-traces 25)."""
    return state.landed in (LandedState.IN_AIR, LandedState.TAKING_OFF, LandedState.LANDING)


def _has_stopped(state: VehicleState) -> bool:
    return state.ground_speed_m_s is not None and state.ground_speed_m_s < STOPPED_M_S


def _why_paused(view: FlightView) -> str:
    """The pause on the way into offboard mode was asked for; that it goes on when control has ended was not."""
    if not view.after_hands:
        return "paused, as asked"
    return _AFTER_HANDS_FAILSAFE if view.state.in_failsafe else _AFTER_HANDS


def _why_stopped(view: FlightView) -> str:
    mode = view.state.mode.value if view.state.mode is not None else "an unknown"
    cause = ": somebody else has control" if view.mode_is_settled else ""
    cause = ": a failsafe acts" if view.in_failsafe else cause
    return f"the vehicle is in {mode} mode{cause}; Waydrop commands nothing"


def _why_returning(view: FlightView) -> str:
    if view.asked is Asked.RETURN:
        return "returning, as asked" if view.rally_point is None else f"to rally point {view.rally_point}, as asked"
    if view.asked is Asked.CONTINGENCY:
        return "a drop failed: returning, as the plan says"
    if view.mission_done:
        return "the mission is done"
    if view.in_failsafe:
        return "a failsafe acts"
    return "somebody else commanded Return mode" if view.mode_is_settled else ""
