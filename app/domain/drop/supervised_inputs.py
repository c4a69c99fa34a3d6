"""Inputs, effects and terms of a supervised drop, and the bounded hold."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

from app.domain.drop.record import Certainty, DropOutcome
from app.domain.mission import CompiledDrop, MavCmd
from app.domain.reasons import Reason
from app.domain.targets import STALE_S
from app.domain.vehicle.commands import CommandAck
from app.domain.vehicle.state import FlightMode, GnssFix, LandedState

OUTPUT_FRESH_S: Final = 2.0
LOADED_S: Final = 1.0
"""How long after a grab of the mission the output has certainly moved."""
MAX_HEIGHT_ERROR_M: Final = 3.0
"""PX4 counts a multicopter's waypoint as reached within 0.8 m of its altitude (NAV_MC_ALT_RAD)."""


@dataclass(frozen=True, slots=True)
class TargetObservation:
    """The moving target of a drop: age of the report, current distance from the vehicle, speed."""

    age_s: float
    distance_m: float | None
    speed_m_s: float


@dataclass(frozen=True, slots=True)
class DropObservation:
    """An observation of the vehicle at `now_s` (monotonic clock of the service, seconds).

    `boot_s` is the vehicle's clock at its newest position, `clock_rate` its rate relative to the service's clock (1 on
    a real vehicle). `offset_m` is the horizontal distance from the drop point. `target` is None without a report, or
    without a moving target. `height_error_m`: how far it is above or below where it is to hover. `mode_is_commanded`:
    `mode` was commanded, and the vehicle still reports Mission mode. `mission_is_sure`: more than one MISSION_CURRENT
    agrees. `mission_is_ours`: it names no other one. `link_is_open`: anybody who can reach the vehicle's link may have
    sent the messages.
    """

    now_s: float
    connected: bool
    mode: FlightMode | None
    armed: bool | None
    in_failsafe: bool
    landed: LandedState
    mission_seq: int | None
    boot_s: float | None
    clock_rate: float
    offset_m: float | None
    ground_speed_m_s: float | None
    position_age_s: float | None
    gnss_fix: GnssFix | None = None
    height_error_m: float | None = None
    gripper_output_us: int | None = None
    gripper_output_age_s: float | None = None
    target: TargetObservation | None = None
    mode_is_commanded: bool = False
    mission_is_sure: bool = True
    mission_is_ours: bool = True
    link_is_open: bool = False

    @property
    def fresh_output_us(self) -> int | None:
        """The gripper output, if known and no older than 2 s."""
        if self.gripper_output_age_s is None or self.gripper_output_age_s > OUTPUT_FRESH_S:
            return None
        return self.gripper_output_us


def output_of(seen: DropObservation | None) -> int | None:
    """The gripper's output, if it is known and fresh."""
    return None if seen is None else seen.fresh_output_us


@dataclass(frozen=True, slots=True)
class ReleaseAck:
    """A COMMAND_ACK of release attempt number `attempt`."""

    now_s: float
    attempt: int
    ack: CommandAck


@dataclass(frozen=True, slots=True)
class ReleaseTimedOut:
    """No final acknowledgement of release attempt `attempt` arrived in time. Its effect is unknown."""

    now_s: float
    attempt: int


@dataclass(frozen=True, slots=True)
class ReleaseWithheld:
    """Release attempt `attempt` was not sent, because its conditions no longer held after it was recorded."""

    now_s: float
    attempt: int


@dataclass(frozen=True, slots=True)
class ConsentGiven:
    """An operator answered request number `question`."""

    now_s: float
    question: int
    grant: bool


@dataclass(frozen=True, slots=True)
class ConsentUnanswered:
    """No telemetry is received, but time passes: consent requests still expire."""

    now_s: float


@dataclass(frozen=True, slots=True)
class RunEnding:
    """The run ends now (landed, aborted, lost, rebooted), so the drop must get an outcome."""

    now_s: float
    reason: Reason


DropInput = (
    DropObservation | ReleaseAck | ReleaseTimedOut | ReleaseWithheld | ConsentGiven | ConsentUnanswered | RunEnding
)


@dataclass(frozen=True, slots=True)
class SendRelease:
    """Send the release once, as attempt number `attempt` (from 1)."""

    attempt: int


@dataclass(frozen=True, slots=True)
class Resume:
    """Advance the mission to `seq`. If that fails, the bounded hold ends by itself."""

    seq: int


@dataclass(frozen=True, slots=True)
class Divert:
    """The parcel is certainly on board: send the vehicle to the alternate, at `seq`. If that fails, the mission
    continues.
    """

    seq: int


@dataclass(frozen=True, slots=True)
class Finish:
    """The drop has ended. Emitted exactly once."""

    outcome: DropOutcome
    certainty: Certainty
    reason: Reason


DropEffect = SendRelease | Resume | Divert | Finish


@dataclass(frozen=True, slots=True)
class OtherGripperItems:
    """The gripper items of the mission that are not the drop's own, as sequence numbers: all move the same output.

    `releases` has supervised drops by their holds. `returns`: the mission jumps back, so an item may come again.
    """

    releases: frozenset[int] = frozenset()
    grabs: frozenset[int] = frozenset()
    returns: bool = False

    def grabs_before(self, hold_seq: int, at: int) -> bool:
        """Whether the mission closes the gripper between the item where it is and the drop."""
        return any(at <= seq < hold_seq for seq in self.grabs)


@dataclass(frozen=True, slots=True)
class DropTerms:
    """Constant for a drop. Seconds are real time, except `hold_s`, which is vehicle time.

    `release_latency_s` is the maximum time from sending a release until it acts: event loop, link and servo. A release
    is sent only if that much hold time is left. `resume_s` is the maximum time of the command to advance the mission.
    `consent_timeout_s`: how long an operator may take to answer; None: as long as the hold allows.
    `target_max_speed_m_s`: None without a moving target. `max_height_error_m`: None where it does not hover.
    `has_gripper`: PX4's gripper, whose output is observable, not a winch. `alternate_seq` leads to the alternate, None
    if there is none; the vehicle waits `leave_s` longer than `hold_s` for it, and nothing is released in that time.
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
    max_height_error_m: float | None = None
    max_target_age_s: float = STALE_S
    alternate_seq: int | None = None
    leave_s: float = 0.0
    others: OtherGripperItems = field(default_factory=OtherGripperItems)
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
    def of(
        cls,
        drop: CompiledDrop,
        max_offset_m: float,
        target_max_speed_m_s: float | None = None,
        others: OtherGripperItems | None = None,
    ) -> DropTerms:
        """Return the terms of a compiled drop. A rover or landed vehicle waits in NAV_DELAY, others in the waypoint."""
        hovers = drop.relative_altitude_m is not None or drop.absolute_altitude_m is not None
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
            max_height_error_m=MAX_HEIGHT_ERROR_M if hovers else None,
            alternate_seq=drop.alternate_seq,
            leave_s=drop.leave_s,
            others=others or OtherGripperItems(),
        )


# Maximum time between the start of a hold and its observation: HEARTBEAT, MISSION_CURRENT and EXTENDED_SYS_STATE are
# sent at 1 Hz on a ground-station link (recording 01).
LATE_SIGN_S = 1.1
# Distance outside the acceptance radius that proves that the hold has not begun.
OUTSIDE_MARGIN_M = 1.0
FORGOTTEN_SHARE = 0.01
"""Of a minute without messages 0.6 s, less than the latency of a release."""
GRIPPER_OPEN_US = 1000
GRIPPER_CLOSED_US = 2000
"""PX4's payload deliverer: 2000 grab, 1000 release, 900 while disarmed [us]."""


@dataclass(frozen=True, slots=True)
class HoldClock:
    """`not_begun_at_s`: a vehicle time at which the hold had certainly not begun; None if never observed.

    `earliest` is our time and the vehicle's by the message that waited least on its way.
    """

    not_begun_at_s: float | None = None
    earliest: tuple[float, float] | None = None

    def observed(self, seen: DropObservation, terms: DropTerms) -> HoldClock:
        """The clock after an observation. Law: with more observations the time left is never over-estimated, by more
        than FORGOTTEN_SHARE of the time for which a link stood still.
        """
        if seen.boot_s is None or seen.position_age_s is None or not seen.connected:
            return self
        vehicle_s = max(seen.boot_s + seen.position_age_s, self._at_least_s(seen.now_s))
        clock = replace(self, earliest=(seen.now_s, vehicle_s))
        sign_s = _surely_before(seen, terms)
        if sign_s is None or (self.not_begun_at_s is not None and sign_s <= self.not_begun_at_s):
            return clock
        return replace(clock, not_begun_at_s=sign_s)

    def left_s(self, seen: DropObservation, terms: DropTerms) -> float:
        """Guaranteed remaining time in seconds of the service's clock; 0 or less if the hold may have ended or its
        start was not observed.
        """
        if self.not_begun_at_s is None or seen.boot_s is None or seen.position_age_s is None:
            return 0.0
        vehicle_now_s = max(seen.boot_s + seen.position_age_s * seen.clock_rate, self._at_least_s(seen.now_s))
        return (self.not_begun_at_s + terms.hold_s - vehicle_now_s) / max(seen.clock_rate, 0.01)

    def _at_least_s(self, now_s: float) -> float:
        """The vehicle's time now, by the message that waited least: its clock is as fast as ours, a simulated one is
        often faster. What a simulator has fallen behind on a busy machine is forgotten with time.
        """
        if self.earliest is None:
            return -math.inf
        ours_s, vehicle_s = self.earliest
        return vehicle_s + (now_s - ours_s) * (1.0 - FORGOTTEN_SHARE)

    def waits_longer_than(self, needed_s: float, seen: DropObservation, terms: DropTerms) -> bool:
        """Whether the vehicle surely still waits for so long, the time to leave for an alternate included."""
        is_known = self.not_begun_at_s is not None and seen.boot_s is not None and seen.position_age_s is not None
        return is_known and self.left_s(seen, terms) + terms.leave_s / max(seen.clock_rate, 0.01) > needed_s


def _surely_before(seen: DropObservation, terms: DropTerms) -> float | None:
    """The vehicle's time up to which this observation proves that the hold had not begun; None if it proves nothing."""
    assert seen.boot_s is not None
    late_s = seen.boot_s - LATE_SIGN_S
    if seen.mode is not FlightMode.MISSION and not seen.mode_is_commanded:
        return late_s  # PX4 restarts the item when Mission mode is entered again
    if seen.mission_seq is not None and seen.mission_seq not in terms.hold_seqs and seen.mission_is_sure:
        return late_s
    if terms.landed:
        return late_s if seen.landed is not LandedState.ON_GROUND else None
    if seen.offset_m is not None and seen.offset_m > terms.acceptance_radius_m + OUTSIDE_MARGIN_M:
        return seen.boot_s
    return None
