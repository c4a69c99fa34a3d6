"""What must be true at the moment a release is sent. Checked again before each try."""

from __future__ import annotations

from app.domain.supervised.hold import HoldClock
from app.domain.supervised.inputs import Observation
from app.domain.supervised.terms import DropTerms
from app.domain.vehicle import FlightMode, LandedState


def is_holding(seen: Observation, terms: DropTerms) -> bool:
    """Arrival: the hold item is current, in Mission mode, inside the radius. Never judged by progress messages."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq in terms.hold_seqs
        and seen.offset_m is not None
        and seen.offset_m <= terms.acceptance_radius_m + terms.max_offset_m
    )


def is_passed(seen: Observation, terms: DropTerms) -> bool:
    """The mission is beyond the hold: whatever was not commanded by now is not commanded any more."""
    return (
        seen.mode is FlightMode.MISSION
        and seen.mission_seq is not None
        and seen.mission_seq not in terms.hold_seqs
        and seen.mission_seq > max(terms.hold_seqs)
    )


def reason_against(seen: Observation, terms: DropTerms, hold: HoldClock) -> str | None:
    """Why a release must not be sent now, in words; None if it may be."""
    return (
        _link_reason(seen, terms)
        or _place_reason(seen, terms)
        or _target_reason(seen, terms)
        or _time_reason(seen, terms, hold)
    )


def _link_reason(seen: Observation, terms: DropTerms) -> str | None:
    if not seen.connected:
        return "the link is lost"
    if seen.in_failsafe:
        return "the vehicle is in a failsafe"
    if seen.armed is not True:
        return "the vehicle is not armed"
    if seen.mode is not FlightMode.MISSION:
        return f"the vehicle is in {seen.mode.value if seen.mode else 'an unknown'} mode"
    if seen.mission_seq not in terms.hold_seqs:
        return "the drop item is not current"
    if seen.position_age_s is None or seen.position_age_s > terms.max_position_age_s:
        return "the position is too old"
    return None


def _place_reason(seen: Observation, terms: DropTerms) -> str | None:
    if seen.offset_m is None or not seen.offset_m <= terms.max_offset_m:
        return f"the vehicle is farther than {terms.max_offset_m:g} m from the drop point"
    if seen.ground_speed_m_s is None or not seen.ground_speed_m_s <= terms.max_ground_speed_m_s:
        return f"the vehicle is faster than {terms.max_ground_speed_m_s:g} m/s"
    if terms.landed and seen.landed is not LandedState.ON_GROUND:
        return "the vehicle is not on the ground"
    return None


def _target_reason(seen: Observation, terms: DropTerms) -> str | None:
    """Of a drop at a moving target: it must be known where it is now, and it must be here."""
    if terms.target_max_speed_m_s is None:
        return None
    target = seen.target
    if target is None:
        return "target_stale: nothing was reported of the target"
    if not target.age_s <= terms.max_target_age_s:
        return f"target_stale: the target's last report is older than {terms.max_target_age_s:g} s"
    if not target.speed_m_s <= terms.target_max_speed_m_s:
        return f"target_too_fast: the target is faster than {terms.target_max_speed_m_s:g} m/s"
    if target.distance_m is None or not target.distance_m <= terms.max_offset_m:
        return f"target_away: the target is farther than {terms.max_offset_m:g} m from the vehicle"
    return None


def _time_reason(seen: Observation, terms: DropTerms, hold: HoldClock) -> str | None:
    if hold.not_begun_at_s is None:
        return "the start of the hold was not seen, so its end is not known"
    if hold.left_s(seen, terms) <= terms.release_latency_s:
        return "too little of the hold is left"
    return None
