"""The mission's progress in a flight: what the vehicle tells of its items, and what that settles."""

from __future__ import annotations

from typing import Final

from app.domain.events.run import RunItem
from app.domain.flight.flight import Flight
from app.domain.flight.inputs import Observation
from app.domain.flight.landing import RETURNS
from app.domain.flight.progress import MissionCompleteDetector
from app.domain.model import changed
from app.domain.run.run import HOLDS, RunAction
from app.domain.vehicle.facts import ItemReached
from app.domain.vehicle.state import FlightMode, LandedState, mission_is_sure

STAYS_ON_MISSION: Final = frozenset({None, *HOLDS, RunAction.RESUME, RunAction.REFUSED})
"""What may be commanded with the mission still being flown to its end."""

OBEYED_IN: Final[dict[RunAction | None, FlightMode]] = {
    **dict.fromkeys(HOLDS, FlightMode.HOLD),
    RunAction.REFUSED: FlightMode.HOLD,
    RunAction.RETURN: FlightMode.RETURN,
    RunAction.CONTINGENCY: FlightMode.RETURN,
    RunAction.LAND: FlightMode.LAND,
}
"""The mode in which a vehicle carries out each command."""


def item_reached(flight: Flight, observed: Observation, fact: ItemReached) -> Flight:
    mode = fact.mode or observed.state.mode
    if flight.names_other(observed.state) or not _is_by_mission(flight, fact.seq, mode):
        return flight
    if flight.segment.mission.is_return(fact.seq):
        flight = flight.flying_to(observed, flight.progress.begun(fact.seq))
    else:
        item_id = flight.progress.plan_item_of.get(fact.seq)
        flight = flight.recording(RunItem(seq=fact.seq, phase="reached", item_id=item_id))
    return flight.with_progress(observed, flight.progress.reached(fact.seq))


def _is_by_mission(flight: Flight, seq: int, mode: FlightMode | None) -> bool:
    """Whether the mission itself came to the item. Its last one may be told late, or be a return. With RTL_TYPE 1 to 4
    any other return may fly along the items to the mission's landing, and PX4 says that it was reached, too.
    """
    if mode is FlightMode.MISSION:
        return True
    last_seq = flight.progress.last_seq
    is_last, was_last = seq == last_seq, flight.progress.current == last_seq
    has_returned = mode is FlightMode.RETURN or flight.mode.has_returned
    is_other_return = flight.run.commanded in RETURNS or not flight.segment.mission.is_return(seq)
    return is_last and (was_last or not (has_returned and is_other_return))


def item_shown(flight: Flight, observed: Observation, seq: int, mode: FlightMode | None) -> Flight:
    """Handle MISSION_CURRENT. The mode of a return distinguishes it from its item, and may arrive first."""
    returns = mode is FlightMode.RETURN and flight.was_airborne and flight.segment.mission.is_return(seq)
    if flight.flies_mission_in(mode) or returns:
        return flight.flying_to(observed, flight.progress.now_current(seq))
    return flight


def follow_mission(flight: Flight, observed: Observation) -> Flight:
    state, run = observed.state, flight.run
    if flight.names_other(state):
        return _settle_command(changed(flight, completion=MissionCompleteDetector()), observed)
    flew_unseen = not flight.mode.has_returned and flight.progress.is_behind(state, run.mission_id)
    names_ours = state.mission_id == run.mission_id
    if state.mission_seq is not None and (flight.flies_mission_in(state.mode) or flew_unseen):
        was_away = flight.link.was_away and state.mode is not FlightMode.MISSION
        flight = changed(flight, link=changed(flight.link, was_away=was_away))
        flight = flight.flying_to(observed, flight.progress.now_current(state.mission_seq))
    elif state.mission_seq is not None and names_ours:
        flight = item_shown(flight, observed, state.mission_seq, state.mode)
    progress = flight.progress
    ended_unseen = flight.link.was_away and names_ours and not flight.mode.has_returned
    near_end = progress.current == progress.last_seq or progress.is_complete or ended_unseen
    flight = _settle_command(changed(flight, completion=flight.completion.seen(state)), observed)
    on_mission = flight.run.commanded in STAYS_ON_MISSION
    is_sure = mission_is_sure(state)
    if near_end and on_mission and is_sure and flight.completion.is_done(state, last_seq=progress.last_seq):
        flight = flight.with_progress(observed, flight.progress.completed())
    if flight.progress.is_complete and on_mission:
        return changed(flight, mission_done=True)
    was_returning = flight.segment.mission.ends_with_return and names_ours and not flight.progress.is_complete
    flies_anew = was_returning and state.mode is FlightMode.MISSION and state.landed is LandedState.IN_AIR
    return changed(flight, mission_done=False) if flies_anew else flight


def _settle_command(flight: Flight, observed: Observation) -> Flight:
    """A command explains one mode change: if the vehicle then resumes its mission, somebody else commanded it."""
    commanded, state = flight.run.commanded, observed.state
    obeyed = commanded if state.mode is OBEYED_IN.get(commanded) else flight.command.obeyed
    in_air = state.landed is not LandedState.ON_GROUND and flight.mode.is_settled(observed.now_s)
    goes_on = obeyed == commanded and in_air  # PX4 may be in Mission for a moment as it lands
    is_resumed = commanded is RunAction.RESUME and state.mode is FlightMode.RETURN and flight.is_in_final_return
    if is_resumed or (commanded and state.mode is FlightMode.MISSION and (commanded is RunAction.RESUME or goes_on)):
        flight = flight.with_run(observed, commanded=None)
    return changed(flight, command=changed(flight.command, obeyed=obeyed if flight.run.commanded else None))
