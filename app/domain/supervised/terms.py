"""The terms of one supervised drop: where, how long the hold is, and what must be true before a release."""

from __future__ import annotations

from dataclasses import dataclass

from app.domain.mission import CompiledDrop, MavCmd
from app.domain.moving_target.report import STALE_S


@dataclass(frozen=True, slots=True)
class DropTerms:
    """Fixed for the whole drop. Seconds are real time except `hold_s`, which is the vehicle's.

    `release_latency_s` is the longest time a sent release may take to act: loop, link and servo together. A release
    is sent only if that much of the hold is left. `resume_s` is the longest time the order to move on may take.
    `consent_timeout_s`: how long an operator may take to answer; None as long as the hold allows.
    `target_max_speed_m_s`: None if the drop has no moving target.
    `has_gripper`: it is PX4's gripper, whose output can be watched, and no winch.
    `alternate_seq` leads to the other place for the parcel, None if there is none; the vehicle waits `leave_s` longer
    than `hold_s` for it, and nothing is released in that time.
    """

    hold_seqs: tuple[int, ...]
    resume_seq: int
    hold_s: float
    acceptance_radius_m: float
    max_offset_m: float
    landed: bool = False
    has_gripper: bool = True
    needs_consent: bool = False
    consent_timeout_s: float | None = None
    target_max_speed_m_s: float | None = None
    max_target_age_s: float = STALE_S
    alternate_seq: int | None = None
    leave_s: float = 0.0
    max_ground_speed_m_s: float = 0.5
    max_attempts: int = 3
    release_latency_s: float = 1.0
    resume_s: float = 3.5
    retry_pause_s: float = 0.3
    max_position_age_s: float = 1.0
    output_wait_s: float = 1.0
    calm_s: float = 0.2
    reentry_calm_s: float = 1.5

    @classmethod
    def of(cls, drop: CompiledDrop, max_offset_m: float, target_max_speed_m_s: float | None = None) -> DropTerms:
        """The terms of a compiled drop. A rover or a landed vehicle waits in NAV_DELAY, others in the waypoint."""
        return cls(
            hold_seqs=drop.hold_seqs,
            resume_seq=drop.resume_seq,
            hold_s=drop.hold_s,
            acceptance_radius_m=drop.acceptance_radius_m,
            max_offset_m=max_offset_m,
            landed=drop.landed,
            has_gripper=drop.command is MavCmd.DO_GRIPPER,
            needs_consent=drop.needs_consent,
            consent_timeout_s=drop.consent_timeout_s,
            target_max_speed_m_s=target_max_speed_m_s,
            alternate_seq=drop.alternate_seq,
            leave_s=drop.leave_s,
        )


# A hold may have begun this long before the link showed it: HEARTBEAT and MISSION_CURRENT come at 1 Hz,
# EXTENDED_SYS_STATE at 1 Hz on a ground-station link (px4-traces 01).
LATE_SIGN_S = 1.1
# How far outside the acceptance radius a vehicle must be seen to be sure that its hold has not begun.
OUTSIDE_MARGIN_M = 1.0
GRIPPER_OPEN_US = 1000
GRIPPER_CLOSED_US = 2000
"""PX4's payload deliverer: 2000 grab, 1000 release, 900 while disarmed [us]."""
