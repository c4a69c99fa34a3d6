"""What must be true at the moment a release is sent. Checked again before each try."""

from __future__ import annotations

from app.domain.reason import Reason, ReasonCode, because
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


def reason_against(seen: Observation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    """Why a release must not be sent now, or None if it may be."""
    return (
        _link_reason(seen, terms)
        or _place_reason(seen, terms)
        or _target_reason(seen, terms)
        or _time_reason(seen, terms, hold)
    )


def _link_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    if not seen.connected:
        return because(ReasonCode.LINK_LOST)
    if seen.in_failsafe:
        return because(ReasonCode.IN_FAILSAFE)
    if seen.armed is not True:
        return because(ReasonCode.NOT_ARMED)
    if seen.mode is not FlightMode.MISSION:
        return because(ReasonCode.WRONG_MODE, mode=seen.mode.value if seen.mode else "an unknown")
    if seen.mission_seq not in terms.hold_seqs:
        return because(ReasonCode.NOT_CURRENT)
    if seen.position_age_s is None or seen.position_age_s > terms.max_position_age_s:
        return because(ReasonCode.POSITION_OLD)
    return None


def _place_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    if seen.offset_m is None or not seen.offset_m <= terms.max_offset_m:
        return because(ReasonCode.TOO_FAR, max_offset_m=terms.max_offset_m)
    if seen.ground_speed_m_s is None or not seen.ground_speed_m_s <= terms.max_ground_speed_m_s:
        return because(ReasonCode.TOO_FAST, max_ground_speed_m_s=terms.max_ground_speed_m_s)
    if terms.landed and seen.landed is not LandedState.ON_GROUND:
        return because(ReasonCode.NOT_ON_GROUND)
    return None


def _target_reason(seen: Observation, terms: DropTerms) -> Reason | None:
    """Of a drop at a moving target: it must be known where it is now, and it must be here."""
    if terms.target_max_speed_m_s is None:
        return None
    target = seen.target
    if target is None:
        return because(ReasonCode.TARGET_UNKNOWN)
    if not target.age_s <= terms.max_target_age_s:
        return because(ReasonCode.TARGET_OLD, max_age_s=terms.max_target_age_s)
    if not target.speed_m_s <= terms.target_max_speed_m_s:
        return because(ReasonCode.TARGET_FAST, max_speed_m_s=terms.target_max_speed_m_s)
    if target.distance_m is None or not target.distance_m <= terms.max_offset_m:
        return because(ReasonCode.TARGET_AWAY, max_offset_m=terms.max_offset_m)
    return None


def _time_reason(seen: Observation, terms: DropTerms, hold: HoldClock) -> Reason | None:
    if hold.not_begun_at_s is None:
        return because(ReasonCode.HOLD_START_UNSEEN)
    if hold.left_s(seen, terms) <= terms.release_latency_s:
        return because(ReasonCode.HOLD_TOO_SHORT)
    return None
