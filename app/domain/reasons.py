"""Reasons: codes with parameters, and their messages."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from string import Formatter
from typing import Final

from pydantic import Field

from app.domain.model import FrozenForm

Param = str | int | float | None
_CAUSE: Final = "cause"


class ReasonCode(StrEnum):
    """Each code with its message. `{name}` is a parameter, `{cause}` the message of the underlying reason."""

    words: str

    def __new__(cls, code: str, words: str) -> ReasonCode:
        """A code with its message."""
        member = str.__new__(cls, code)
        member._value_ = code
        member.words = words
        return member

    # vehicles
    TWO_CLOCKS = "vehicle.two_clocks", "time since boot or position alternates between two vehicles"
    TWO_UIDS = "vehicle.two_uids", "two vehicles answer, with the UIDs {known} and {other}"
    TWO_CONNECTIONS = (
        "vehicle.two_connections",
        "system ID {system_id} of {connection} is also on {also}, where it was seen first",
    )
    # runs, before and after a flight
    ERROR = "error", "{detail}"
    ERROR_WITH_HINT = "error_with_hint", "{detail}; {hint}"
    UPLOAD_VERIFIED = "run.upload_verified", "the vehicle reports the ID of the uploaded mission"
    UPLOAD_READ_BACK = "run.upload_read_back", "all items were read back from the vehicle"
    ABORTED_ON_GROUND = "run.aborted_on_ground", "aborted before takeoff"
    NEW_WARNINGS = "run.new_warnings", "checked again at the start, the plan has new warnings: {detail}"
    START_ABORTED_ARMED = "run.start_aborted_armed", "the start was aborted; the vehicle did not disarm"
    START_FAILED_ARMED = "run.start_failed_armed", "the start failed: {detail}; the vehicle did not disarm"
    START_BROKE_ARMED = "run.start_broke_armed", "the start failed; the vehicle did not disarm"
    RESTART_BEFORE_UPLOAD_ENDED = (
        "run.restart_before_upload_ended",
        "Waydrop restarted during the upload; the run was not started",
    )
    RESTART_DURING_START_ARMED = (
        "run.restart_during_start_armed",
        "Waydrop restarted during the start; the vehicle is armed",
    )
    RESTART_DURING_START_DISARMED = (
        "run.restart_during_start_disarmed",
        "Waydrop restarted during the start; the vehicle is disarmed",
    )
    START_HELD_BACK = "run.start_held_back", "the start was ended before arming, because the queue was {cause}"
    TAKEN_OVER_BEFORE_START = (
        "run.taken_over_before_start",
        "another gateway took the run over before it was told that it had started",
    )
    NOT_SEEN_AFTER_RESTART = "run.not_seen_after_restart", "the vehicle was not seen again after Waydrop restarted"
    OTHER_MISSION_ON_BOARD = (
        "run.other_mission_on_board",
        "the mission on board is not the run's: the vehicle lost it in a restart, or another client uploaded one",
    )
    MISSION_UNREAD = (
        "run.mission_unread",
        "after a restart the mission on board cannot be read; Waydrop does not follow the run yet ({cause})",
    )
    ABORTED_UNREAD = (
        "run.aborted_unread",
        "aborted while the mission on board could not be read after a restart; if armed, the vehicle was commanded to "
        "return",
    )
    DISARMED_BEFORE_TAKEOFF = "run.disarmed_before_takeoff", "the vehicle disarmed before takeoff"
    NOT_TAKEN_OFF = "run.not_taken_off", "the vehicle did not take off"
    REBOOTED = "run.rebooted", "the vehicle rebooted in flight"
    NOT_HEARD = "run.not_heard", "no message from the vehicle for {silent_s:.0f} s"
    STOPPED_AT_LAST_ITEM = "run.stopped_at_last_item", "the vehicle stopped at the last item"
    HOLDS_AT_LAST_ITEM = (
        "run.holds_at_last_item",
        "the vehicle holds at the last item; it reports landed only after its crew disarms it",
    )
    ASKED_BEFORE_DONE = "run.asked_before_done", "commanded to {asked} before the mission was complete"
    RETURNED_AFTER_FAILED_DROP = (
        "run.returned_after_failed_drop",
        "a drop failed; the vehicle returned, as the plan specifies",
    )
    ENDED_EARLY = "run.ended_early", "the vehicle ended its flight before the mission was complete"
    ENDED_EARLY_BECAUSE = (
        "run.ended_early_because",
        "the vehicle ended its flight before the mission was complete ({cause})",
    )
    LANDED_ELSEWHERE = "run.landed_elsewhere", "the vehicle did not land at its destination ({cause})"
    FELL = (
        "run.fell",
        "the vehicle fell about {fallen_m:.0f} m to the ground: it was disarmed in the air, or its motors stopped",
    )
    FLOWN_TO_END = "run.flown_to_end", "the mission is complete"
    RUN_ENDED = "run.ended", "the run ended as {state}"

    # runs, in flight
    WAITS_FOR_CONSENT = "run.waits_for_consent", "waiting for an operator's consent to {plan_item_id}"
    ON_GROUND = "run.on_ground", "on the ground"
    MISSION_DONE = "run.mission_done", "the mission is complete"
    HOLDS_WHERE_IT_ENDED = (
        "run.holds_where_it_ended",
        "the mission is complete; the vehicle holds where it ended",
    )
    PAUSED_AS_ASKED = "run.paused_as_asked", "paused by command"
    PAUSED_AMID_FAILSAFE = "run.paused_amid_failsafe", "paused by command, which cancelled a failsafe: {cause}"
    HOLDING_AFTER_FAILED_DROP = (
        "run.holding_after_failed_drop",
        "a drop failed; holding, as the plan specifies",
    )
    RESUMING_AS_ASKED = "run.resuming_as_asked", "resuming by command"
    RETURNING_AS_ASKED = "run.returning_as_asked", "returning by command"
    RETURNING_TO_RALLY_POINT = "run.returning_to_rally_point", "diverting to rally point {rally_point} by command"
    RETURNING_AFTER_FAILED_DROP = (
        "run.returning_after_failed_drop",
        "a drop failed; returning, as the plan specifies",
    )
    LANDING_AS_ASKED = "run.landing_as_asked", "landing by command"
    VEHICLE_LANDS = "run.vehicle_lands", "the vehicle is landing"
    LANDING_UNSEEN = "run.landing_unseen", "the link was lost before it landed"
    CHANGE_REFUSED = (
        "run.change_refused",
        "the vehicle rejected the changed mission and holds; resume flies the previous one",
    )
    OFFBOARD = "run.offboard", "under offboard control: the mission is suspended, and Waydrop commands no drops"
    AFTER_OFFBOARD = "run.after_offboard", "paused after offboard control: the vehicle holds"
    AFTER_OFFBOARD_FAILSAFE = (
        "run.after_offboard_failsafe",
        "paused after offboard control: a failsafe is active, and the vehicle holds",
    )
    FAILSAFE = "run.failsafe", "a failsafe is active"
    FAILSAFE_MODE = (
        "run.failsafe_mode",
        "the vehicle is in {mode} mode: a failsafe is active; Waydrop sends no commands",
    )
    HOME_MOVED = (
        "run.home_moved",
        "home was moved {moved_m:.1f} m {direction} in flight, not by Waydrop: the altitudes above home moved with it",
    )
    TERMINATED = (
        "run.terminated",
        "the flight was terminated: a failsafe or the kill switch has stopped the motors; no command is obeyed",
    )
    RETURN_BY_OTHERS = "run.return_by_others", "another client or pilot commanded Return mode"
    LAND_BY_OTHERS = (
        "run.land_by_others",
        "a pilot, another client or the autopilot commanded Land mode",
    )
    NO_VALID_MISSION = (
        "run.no_valid_mission",
        "the vehicle has no valid mission any more, and holds: {detail}",
    )
    TAKEN_BY_OTHERS = (
        "run.taken_by_others",
        "the vehicle is in {mode} mode: another client or pilot has control; Waydrop sends no commands",
    )
    NOT_IN_MISSION = "run.not_in_mission", "the vehicle is in {mode} mode; Waydrop sends no commands"

    # drops: observations
    DROP_OUTPUT_RELEASED = "drop.output_released", "the gripper output moved to release"
    DROP_ACKNOWLEDGED = "drop.acknowledged", "acknowledged"
    DROP_ACKNOWLEDGED_MOVED = "drop.acknowledged_moved", "acknowledged, and the output moved"
    DROP_ACKNOWLEDGED_NO_MOVE = "drop.acknowledged_no_move", "acknowledged; no movement of an output was observed"
    DROP_ACKNOWLEDGED_UNSEEN = "drop.acknowledged_unseen", "acknowledged; the output was not observed"
    DROP_ACKNOWLEDGED_NOT_MOVED = (
        "drop.acknowledged_not_moved",
        "acknowledged, but the gripper output did not move",
    )
    DROP_ACKNOWLEDGED_ON_OPEN_LINK = (
        "drop.acknowledged_on_open_link",
        "acknowledged on an open link, where anyone could have sent it; no movement of an output was observed",
    )
    DROP_ACKNOWLEDGED_THEN = "drop.acknowledged_then", "acknowledged; then {cause}"
    DROP_ACK_MISSING = "drop.ack_missing", "no final acknowledgement (attempts: {attempts})"
    DROP_ACK_MISSING_RELEASED = (
        "drop.ack_missing_released",
        "no final acknowledgement, but the gripper output moved to release",
    )
    DROP_ACK_MISSING_RELEASED_THEN = (
        "drop.ack_missing_released_then",
        "no final acknowledgement, but the gripper output moved to release; {cause}",
    )
    DROP_REFUSED = "drop.refused", "the vehicle rejected the release: {result}"
    DROP_BUT_RELEASED = "drop.but_released", "{cause}; but the gripper output moved to release"
    DROP_GRIPPER_BY_TASK = (
        "drop.gripper_by_task",
        "a task of offboard control used the gripper before the drop; {cause}",
    )
    DROP_STILL_AT_GRAB = "drop.still_at_grab", "{cause}; the gripper output is still at grab"
    DROP_OPEN_BEFORE_COMMAND = "drop.open_before_command", "the gripper was open before the release was commanded"
    DROP_HOLD_NOT_SEEN = "drop.hold_not_seen", "the mission passed the drop, and no hold was observed"
    DROP_HOLD_OVER = "drop.hold_over", "the hold has ended"
    DROP_HOLD_OVER_BEFORE_RELEASE = (
        "drop.hold_over_before_release",
        "the hold ended before a release could be sent",
    )
    DROP_HOLD_OVER_BEFORE_ACK = (
        "drop.hold_over_before_ack",
        "the hold ended before the release was acknowledged",
    )
    DROP_HOLD_OVER_AS = "drop.hold_over_as", "the hold ended before a release was possible: {cause}"
    DROP_TOO_LATE_TO_ASK = "drop.too_late_to_ask", "too little hold time was left to request consent"

    # drops: conditions that prevent a release
    LINK_LOST = "drop.link_lost", "the link is lost"
    IN_FAILSAFE = "drop.in_failsafe", "the vehicle is in a failsafe"
    NOT_ARMED = "drop.not_armed", "the vehicle is not armed"
    WRONG_MODE = "drop.wrong_mode", "the vehicle is in {mode} mode"
    OTHER_MISSION = "drop.other_mission", "the mission on board is not the run's"
    NOT_CURRENT = "drop.not_current", "the drop item is not current"
    POSITION_OLD = "drop.position_old", "the position is too old"
    NO_GNSS = "drop.no_gnss", "the vehicle has no 3D GNSS fix, so its position is an estimate"
    TOO_FAR = "drop.too_far", "the vehicle is more than {max_offset_m:g} m from the drop point"
    WRONG_HEIGHT = (
        "drop.wrong_height",
        "the vehicle is more than {max_height_error_m:g} m above or below the altitude of the drop",
    )
    TOO_FAST = "drop.too_fast", "the vehicle is faster than {max_ground_speed_m_s:g} m/s"
    NOT_ON_GROUND = "drop.not_on_ground", "the vehicle is not on the ground"
    HOLD_START_UNSEEN = "drop.hold_start_unseen", "the start of the hold was not observed, so its end is unknown"
    HOLD_TOO_SHORT = "drop.hold_too_short", "too little hold time is left"
    TARGET_UNKNOWN = "drop.target_unknown", "no position of the target was reported"
    TARGET_OLD = "drop.target_stale", "the last report of the target is older than {max_age_s:g} s"
    TARGET_FAST = "drop.target_too_fast", "the target is faster than {max_speed_m_s:g} m/s"
    TARGET_AWAY = "drop.target_away", "the target is more than {max_offset_m:g} m from the vehicle"
    CONSENT_REFUSED = "drop.consent_refused", "an operator refused the release"
    CONSENT_TIMED_OUT = "drop.consent_timed_out", "no operator consented in time"
    CONSENT_LEFT_HOLD = "drop.left_hold", "the vehicle left its hold"
    CONSENT_RESTARTED = "drop.restarted", "Waydrop restarted, which withdrew the request"

    # drops that are mission items
    ITEM_NOT_REACHED = "drop.item_not_reached", "the item was not reached: {cause}"
    ITEM_UNSEEN = "drop.item_unseen", "the item passed unobserved: {cause}"
    ITEM_MAY_HAVE_PASSED = "drop.item_may_have_passed", "the item may have passed unobserved: {cause}"
    ITEM_UNSEEN_PLACE = "drop.item_unseen_place", "{cause}; the vehicle was not observed when the item passed"
    ITEM_STRAYED = "drop.item_strayed", "the gripper output moved to release away from the item; {cause}"
    ITEM_OPEN_BEFORE = "drop.item_open_before", "the gripper was open before the item"
    ITEM_OPENING_UNSEEN = (
        "drop.item_opening_unseen",
        "the gripper is open, and its output was not observed before the item passed",
    )
    ITEM_LATER_RELEASE = "drop.item_later_release", "the item passed unobserved, and so did a later release"
    ITEM_LATER_GRAB = "drop.item_later_grab", "the item passed unobserved, and so did a later grab"
    ITEM_AT_GRAB = "drop.item_at_grab", "the item passed, but the gripper output stayed at grab"
    ITEM_OUTPUT_UNKNOWN = "drop.item_output_unknown", "the item passed, but the gripper output is unknown"
    ITEM_WINCH = "drop.item_winch", "the item passed, and telemetry does not show what a winch does"
    ITEM_NO_OUTPUT = (
        "drop.item_no_output",
        "the item passed, but no output is assigned to the gripper: no movement was observed",
    )
    PLAN_CHANGED = "drop.plan_changed", "the plan was changed in flight"
    PLAN_CHANGED_WHILE_AWAY = (
        "drop.plan_changed_while_away",
        "the plan was changed in flight while Waydrop restarted",
    )

    # returns to a rally point
    RALLY_POINT = (
        "rally.nearest",
        "rally point {rally_point}, {distance_m:.0f} m away: {choice} ({setting})",
    )
    RALLY_POINT_OR = (
        "rally.nearest_or",
        "rally point {rally_point} or {others}, {distance_m:.0f} m away: {choice} ({setting}), "
        "depending on where the return begins",
    )
    RALLY_STAYS_IN_AIR = "rally.stays_in_air", "{cause}; the vehicle does not land there ({setting})"

    # moving targets
    FEED_SILENT = "target.feed_silent", "no report from {feed} yet"
    FEED_STALE = "target.stale", "the last report from {feed} is {age_s:.0f} s old"
    FEED_TOO_FAST = (
        "target.too_fast",
        "the target moves at {speed_m_s:.1f} m/s; the limit is {max_speed_m_s:g} m/s",
    )
    FEED_UNREACHABLE = "target.unreachable", "at {speed_m_s:.3g} m/s the vehicle cannot catch up with the target"
    FEED_OUT_OF_BOUNDS = (
        "target.out_of_bounds",
        "the intercept is {moved_m:.0f} m from the planned point; the limit is {max_move_m:g} m",
    )

    # predicted against flown
    NO_RELEASE_SENT = "comparison.no_release_sent", "no release was sent: {cause}"
    NOT_FLOWN = "comparison.not_flown", "not flown: the run ended as {state}"
    NOT_FLOWN_YET = "comparison.not_flown_yet", "not flown yet"
    ENDS_UNSEEN = "comparison.ends_unseen", "the vehicle was not observed at the start or the end"
    VISIT_NOT_PREDICTED = "comparison.visit_not_predicted", "this visit was not predicted"
    DROP_NOT_PREDICTED = "comparison.drop_not_predicted", "this drop was not predicted"
    NOT_DROPPED_YET = "comparison.not_dropped_yet", "not dropped yet"
    RELEASE_UNSEEN = "comparison.release_unseen", "the vehicle was not observed at the release"
    PLACE_NOT_PREDICTED = "comparison.place_not_predicted", "no position is predicted on a circle"
    FLOWN_FROM = "comparison.flown_from", "flown from {item_id}"
    ALTERNATE_OF = "comparison.alternate_of", "the alternate of {item_id}"
    RUN_NOT_PREDICTED = "comparison.run_not_predicted", "no prediction was recorded"

    # jobs and the queues of vehicles
    JOB_CANCELLED = "job.cancelled", "cancelled by {actor}"
    JOB_EXPIRED = "job.expired", "the deadline passed before the job was started"
    JOB_RUN_NEVER_MADE = "job.run_never_made", "Waydrop stopped before the run was created"
    JOB_STARTED_FIRST = "job.started_first", "the run started before it could be cancelled"
    JOB_WAITS_FOR_START = "job.waits_for_start", "waiting for an operator to start it"
    JOB_START_UNKNOWN = (
        "job.start_unknown",
        "Waydrop stopped while starting the run; it does not retry, but an operator may start it",
    )
    JOB_IS_TO_END = "job.is_to_end", "the job is being cancelled"
    JOB_NOT_READY = "job.not_ready", "not started yet: {refusal}"
    JOB_RUN_ENDED = "job.run_ended", "the run was ended: {cause}"
    JOB_VEHICLE_FAILED = "job.vehicle_failed", "vehicle {vehicle_id}: {detail}"
    JOB_NOT_TAKEN = "job.not_taken", "the gateway of {site} did not take it: {detail}"
    JOB_NEVER_CAME = "job.never_came", "the order to fly it did not reach the gateway"
    JOB_CLAIM_CLEARED = "job.claim_cleared", "taken from the gateway of {site} by {actor}"
    RUN_BAD = "job.run_bad", "run {run_id} ended as {state}"
    RUN_BAD_BECAUSE = "job.run_bad_because", "run {run_id} ended as {state}: {cause}"
    DROP_BAD = "job.drop_bad", "run {run_id} completed, but drop {plan_item_id} is {outcome}"
    DROP_BAD_BECAUSE = (
        "job.drop_bad_because",
        "run {run_id} completed, but drop {plan_item_id} is {outcome} ({cause})",
    )
    QUEUE_STOPPED = "job.queue_stopped", "stopped by {actor}"
    ONLY_CANDIDATE = "job.only_candidate", "the only suitable vehicle"
    CHOSEN = "job.chosen", "chosen from the suitable vehicles"
    ANOTHER_CHOSEN = "job.another_chosen", "suitable, but {vehicle_id} was preferred"

    # offboard control: reasons of a state, and why a lease ended
    OFFBOARD_CHECKING = "offboard.checking", "reading parameters and the geofence"
    OFFBOARD_COMMANDING_HOLD = "offboard.commanding_hold", "commanding Hold mode"
    OFFBOARD_STREAM_FIRST = "offboard.stream_first", "streaming setpoints before requesting the mode"
    OFFBOARD_ASKING_MODE = "offboard.asking_mode", "requesting the mode"
    OFFBOARD_ENTRY_BROKEN_OFF = "offboard.entry_broken_off", "the entry was aborted"
    OFFBOARD_LEAVING = "offboard.leaving", "leaving to {to}"
    OFFBOARD_LEAVING_FAILED = "offboard.leaving_failed", "leaving to {to} failed"
    OFFBOARD_LEFT = "offboard.left", "left to {to}"
    OFFBOARD_RELEASED = "offboard.released", "the holder released the lease"
    OFFBOARD_SOCKET_CLOSED = "offboard.socket_closed", "the client disconnected"
    OFFBOARD_NOT_RENEWED = "offboard.not_renewed", "the lease was not renewed for {lease_s:g} s"
    OFFBOARD_CLIENT_SILENT = "offboard.client_silent", "the client was silent for {silent_s:.1f} s"
    OFFBOARD_ALL_REJECTED = (
        "offboard.all_rejected",
        "no setpoint was accepted for {silent_s:.1f} s, the last one was rejected with {refusal}: {detail}",
    )
    OFFBOARD_LINK_LOST = "offboard.link_lost", "the link to the vehicle is lost"
    OFFBOARD_REBOOTED = "offboard.rebooted", "the vehicle rebooted"
    OFFBOARD_QUARANTINED = "offboard.quarantined", "the vehicle is quarantined"
    OFFBOARD_DISARMED = "offboard.disarmed", "the vehicle disarmed"
    OFFBOARD_COMMANDED = "offboard.commanded", "an operator commanded {command}"
    OFFBOARD_FAILSAFE = "offboard.failsafe", "a failsafe is active"
    OFFBOARD_FAILSAFE_MODE = "offboard.failsafe_mode", "the vehicle is in {mode} mode: a failsafe is active"
    OFFBOARD_FAILSAFE_IN_HOLD = (
        "offboard.failsafe_in_hold",
        "a failsafe is active in Hold mode; the next command would end it",
    )
    OFFBOARD_MODE_BY_OTHERS = (
        "offboard.mode_by_others",
        "the vehicle is in {mode} mode, commanded by another client or pilot",
    )
    OFFBOARD_HOVERS = "offboard.hovers", "the vehicle now hovers; it was controlled by commands in fixed-wing flight"
    OFFBOARD_NOT_GUIDED = (
        "offboard.not_guided",
        "no command was sent for {silent_s:.1f} s: {detail}",
    )
    OFFBOARD_UNANSWERED = "offboard.unanswered", "the vehicle did not answer {count} commands in a row"
    OFFBOARD_REFUSED = "offboard.refused", "the vehicle rejected {count} commands in a row: {detail}"
    OFFBOARD_CANNOT_SEND = "offboard.cannot_send", "sending failed: {detail}"
    OFFBOARD_DEFECT = "offboard.defect", "internal error: no more setpoints can be sent"
    OFFBOARD_STOOD_STILL = "offboard.stood_still", "the service was suspended for {gap_s:.1f} s"
    OFFBOARD_SERVICE_STOPS = "offboard.service_stops", "the service is shutting down"
    OFFBOARD_SERVICE_RESTARTED = "offboard.service_restarted", "the service restarted"
    OFFBOARD_HOLD_UNCONFIRMED = (
        "offboard.hold_unconfirmed",
        "{cause}; Hold mode is not confirmed ({detail}): the vehicle's own failsafe takes over",
    )
    OFFBOARD_CIRCLE_UNCONFIRMED = (
        "offboard.circle_unconfirmed",
        "{cause}; Hold mode is not confirmed ({detail}): the vehicle loiters at its last position",
    )

    # tasks
    TASK_PAUSED = "task.paused", "paused by the client"
    TASK_CLIENT_FLIES = "task.client_flies", "the client is sending setpoints"
    TASK_LEAVING = "task.leaving", "the client requested to leave"
    TASK_LEAVING_FAILED = "task.leaving_failed", "leaving to {to} failed: {detail}"
    TASK_NONE_LEFT = "task.none_left", "no tasks are left"
    TASK_ENDED_BEFORE_ANSWER = "task.ended_before_answer", "the task ended before the vehicle answered"

    # webhooks
    WEBHOOK_DISABLED = "webhook.disabled", "disabled by {actor}"
    WEBHOOK_GONE = "webhook.gone", "the receiver returned 410 Gone"

    @property
    def parameters(self) -> frozenset[str]:
        """The parameters of the message, including "cause" if it has one."""
        return frozenset(name for _, name, _, _ in Formatter().parse(self.words) if name)


class Reason(FrozenForm):
    """A code with its parameters and an optional underlying reason. Compare the code, never the message."""

    code: ReasonCode
    params: dict[str, Param] = Field(default_factory=dict)
    cause: Reason | None = None

    @classmethod
    def of(cls, code: ReasonCode, cause: Reason | None = None, /, **params: Param) -> Reason:
        """Return a reason; `params` are the parameters of its message."""
        return cls(code=code, params=params, cause=cause)

    @classmethod
    def of_error(cls, code: str, detail: str, hint: str = "") -> Reason:
        if hint:
            return cls.of(ReasonCode.ERROR_WITH_HINT, error=code, detail=detail, hint=hint)
        return cls.of(ReasonCode.ERROR, error=code, detail=detail)

    def __str__(self) -> str:
        """Return the code, for logs."""
        return self.code.value

    @property
    def codes(self) -> Iterator[ReasonCode]:
        """Its own code, then those of the underlying reasons."""
        yield self.code
        if self.cause is not None:
            yield from self.cause.codes


def describe(reason: Reason | None) -> str:
    """Return the message, without capital and period; empty for None. For display only: never compare or store it."""
    if reason is None:
        return ""
    known = {name: "?" if value is None else value for name, value in reason.params.items()}
    return "".join(_filled(reason.code.words, {**known, _CAUSE: describe(reason.cause)}))


def _filled(words: str, known: dict[str, str | int | float]) -> Iterator[str]:
    for text, name, form, _ in Formatter().parse(words):
        yield text
        if name:
            value = known.get(name, "?")
            yield format(value, form or "") if not isinstance(value, str) else value
