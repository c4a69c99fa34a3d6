"""The page of all reasons, and the words that the browser's page makes sentences of, both made from the codes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from enum import StrEnum
from string import Formatter
from typing import Final

from pydantic import BaseModel, ConfigDict, Field

# Why something is as it is: a code with parameters. Only what people read turns it into a sentence.


Param = str | int | float | None
_CAUSE: Final = "cause"


class ReasonCode(StrEnum):
    """Each code with its words. `{name}` stands for a parameter, `{cause}` for the reason behind this one."""

    words: str

    def __new__(cls, code: str, words: str) -> ReasonCode:
        """A code that knows its words."""
        member = str.__new__(cls, code)
        member._value_ = code
        member.words = words
        return member

    # vehicles
    TWO_CLOCKS = "vehicle.two_clocks", "time since boot or position jump to and fro between two vehicles"
    TWO_UIDS = "vehicle.two_uids", "two vehicles answer, with the uids {known} and {other}"
    TWO_CONNECTIONS = (
        "vehicle.two_connections",
        "system id {system_id} of {connection} is also on {also}, where it was seen first",
    )
    # runs, before and after a flight
    ERROR = "error", "{detail}"
    ERROR_WITH_HINT = "error_with_hint", "{detail}; {hint}"
    UPLOAD_VERIFIED = "run.upload_verified", "the vehicle names the same mission"
    UPLOAD_READ_BACK = "run.upload_read_back", "each item was read back from the vehicle"
    ABORTED_ON_GROUND = "run.aborted_on_ground", "aborted before take-off"
    START_ABORTED_ARMED = "run.start_aborted_armed", "its start was aborted; the vehicle did not disarm"
    START_FAILED_ARMED = "run.start_failed_armed", "its start failed: {detail}; the vehicle did not disarm"
    START_BROKE_ARMED = "run.start_broke_armed", "its start failed; the vehicle did not disarm"
    RESTART_BEFORE_UPLOAD_ENDED = (
        "run.restart_before_upload_ended",
        "Waydrop restarted before the upload ended; nothing was started",
    )
    RESTART_DURING_START_ARMED = (
        "run.restart_during_start_armed",
        "Waydrop restarted during the start; the vehicle is armed",
    )
    RESTART_DURING_START_DISARMED = (
        "run.restart_during_start_disarmed",
        "Waydrop restarted during the start; the vehicle is disarmed",
    )
    NOT_SEEN_AFTER_RESTART = "run.not_seen_after_restart", "the vehicle was not seen again after Waydrop restarted"
    OTHER_MISSION_ON_BOARD = (
        "run.other_mission_on_board",
        "the vehicle carries another mission than the run's: it restarted empty, or somebody uploaded to it",
    )
    DISARMED_BEFORE_TAKEOFF = "run.disarmed_before_takeoff", "disarmed before it took off"
    NOT_TAKEN_OFF = "run.not_taken_off", "the vehicle did not take off"
    REBOOTED = "run.rebooted", "the vehicle rebooted in flight"
    NOT_HEARD = "run.not_heard", "not heard for {silent_s:.0f} s"
    STOPPED_AT_LAST_ITEM = "run.stopped_at_last_item", "stopped at its last item"
    HOLDS_AT_LAST_ITEM = (
        "run.holds_at_last_item",
        "holds at its last item; it says landed only when its crew disarms it",
    )
    ASKED_BEFORE_DONE = "run.asked_before_done", "asked to {asked} before the mission was done"
    RETURNED_AFTER_FAILED_DROP = (
        "run.returned_after_failed_drop",
        "a drop failed: the vehicle returned, as the plan says",
    )
    ENDED_EARLY = "run.ended_early", "the vehicle ended its flight before the mission was done"
    FLOWN_TO_END = "run.flown_to_end", "the mission was flown to its end"
    RUN_ENDED = "run.ended", "the run ended {state}"

    # runs, in flight
    WAITS_FOR_CONSENT = "run.waits_for_consent", "waits for an operator's consent to {plan_item_id}"
    ON_GROUND = "run.on_ground", "on the ground"
    MISSION_DONE = "run.mission_done", "the mission is done"
    HOLDS_WHERE_IT_ENDED = (
        "run.holds_where_it_ended",
        "the mission is finished: the vehicle holds where it ended",
    )
    PAUSED_AS_ASKED = "run.paused_as_asked", "paused, as asked"
    RESUMING_AS_ASKED = "run.resuming_as_asked", "resuming, as asked"
    RETURNING_AS_ASKED = "run.returning_as_asked", "returning, as asked"
    RETURNING_TO_RALLY_POINT = "run.returning_to_rally_point", "to rally point {rally_point}, as asked"
    RETURNING_AFTER_FAILED_DROP = (
        "run.returning_after_failed_drop",
        "a drop failed: returning, as the plan says",
    )
    LANDING_AS_ASKED = "run.landing_as_asked", "landing, as asked"
    VEHICLE_LANDS = "run.vehicle_lands", "the vehicle lands"
    CHANGE_REFUSED = (
        "run.change_refused",
        "the vehicle refused its changed mission, and holds; resume flies the one before",
    )
    OFFBOARD = "run.offboard", "in offboard control: the mission waits, and Waydrop drops nothing"
    AFTER_OFFBOARD = "run.after_offboard", "paused after offboard control: the vehicle holds"
    AFTER_OFFBOARD_FAILSAFE = (
        "run.after_offboard_failsafe",
        "paused after offboard control: a failsafe acts, and the vehicle holds",
    )
    FAILSAFE = "run.failsafe", "a failsafe acts"
    FAILSAFE_MODE = "run.failsafe_mode", "the vehicle is in {mode} mode: a failsafe acts; Waydrop commands nothing"
    RETURN_BY_OTHERS = "run.return_by_others", "somebody else commanded Return mode"
    TAKEN_BY_OTHERS = (
        "run.taken_by_others",
        "the vehicle is in {mode} mode: somebody else has control; Waydrop commands nothing",
    )
    NOT_IN_MISSION = "run.not_in_mission", "the vehicle is in {mode} mode; Waydrop commands nothing"

    # drops: what is seen and heard of them
    DROP_OUTPUT_RELEASED = "drop.output_released", "the gripper's output went to release"
    DROP_ACKNOWLEDGED = "drop.acknowledged", "acknowledged"
    DROP_ACKNOWLEDGED_MOVED = "drop.acknowledged_moved", "acknowledged, and the output moved"
    DROP_ACKNOWLEDGED_NO_MOVE = "drop.acknowledged_no_move", "acknowledged; no output was seen to move"
    DROP_ACKNOWLEDGED_UNSEEN = "drop.acknowledged_unseen", "acknowledged; the output was not seen"
    DROP_ACKNOWLEDGED_NOT_MOVED = (
        "drop.acknowledged_not_moved",
        "acknowledged, but the gripper's output did not move",
    )
    DROP_ACKNOWLEDGED_THEN = "drop.acknowledged_then", "acknowledged; then {cause}"
    DROP_ACK_MISSING = "drop.ack_missing", "no final ack in {attempts} attempts"
    DROP_ACK_MISSING_RELEASED = (
        "drop.ack_missing_released",
        "no final ack, but the gripper's output went to release",
    )
    DROP_ACK_MISSING_RELEASED_THEN = (
        "drop.ack_missing_released_then",
        "no final ack, but the gripper's output went to release; {cause}",
    )
    DROP_REFUSED = "drop.refused", "the vehicle refused the release: {result}"
    DROP_BUT_RELEASED = "drop.but_released", "{cause}; but the gripper's output went to release"
    DROP_STILL_AT_GRAB = "drop.still_at_grab", "{cause}; the gripper's output is still at grab"
    DROP_OPEN_BEFORE_COMMAND = "drop.open_before_command", "the gripper was open before the release was commanded"
    DROP_HOLD_NOT_SEEN = "drop.hold_not_seen", "the mission passed the drop without a hold that was seen"
    DROP_HOLD_OVER = "drop.hold_over", "the hold is over"
    DROP_HOLD_OVER_BEFORE_RELEASE = (
        "drop.hold_over_before_release",
        "the hold was over before a release could be sent",
    )
    DROP_HOLD_OVER_BEFORE_ACK = (
        "drop.hold_over_before_ack",
        "the hold was over before the release was acknowledged",
    )
    DROP_TOO_LATE_TO_ASK = "drop.too_late_to_ask", "too little of the hold was left to ask for consent"

    # drops: what forbids a release
    LINK_LOST = "drop.link_lost", "the link is lost"
    IN_FAILSAFE = "drop.in_failsafe", "the vehicle is in a failsafe"
    NOT_ARMED = "drop.not_armed", "the vehicle is not armed"
    WRONG_MODE = "drop.wrong_mode", "the vehicle is in {mode} mode"
    NOT_CURRENT = "drop.not_current", "the drop item is not current"
    POSITION_OLD = "drop.position_old", "the position is too old"
    TOO_FAR = "drop.too_far", "the vehicle is farther than {max_offset_m:g} m from the drop point"
    TOO_FAST = "drop.too_fast", "the vehicle is faster than {max_ground_speed_m_s:g} m/s"
    NOT_ON_GROUND = "drop.not_on_ground", "the vehicle is not on the ground"
    HOLD_START_UNSEEN = "drop.hold_start_unseen", "the start of the hold was not seen, so its end is not known"
    HOLD_TOO_SHORT = "drop.hold_too_short", "too little of the hold is left"
    TARGET_UNKNOWN = "drop.target_unknown", "nothing was reported of the target"
    TARGET_OLD = "drop.target_stale", "the target's last report is older than {max_age_s:g} s"
    TARGET_FAST = "drop.target_too_fast", "the target is faster than {max_speed_m_s:g} m/s"
    TARGET_AWAY = "drop.target_away", "the target is farther than {max_offset_m:g} m from the vehicle"
    CONSENT_REFUSED = "drop.consent_refused", "an operator refused the release"
    CONSENT_TIMED_OUT = "drop.consent_timed_out", "no operator consented in time"
    CONSENT_LEFT_HOLD = "drop.left_hold", "the vehicle left its hold"
    CONSENT_RESTARTED = "drop.restarted", "Waydrop restarted: what was asked before does not count any more"

    # drops that are mission items
    ITEM_NOT_REACHED = "drop.item_not_reached", "its item was not reached: {cause}"
    ITEM_UNSEEN = "drop.item_unseen", "its item passed unseen: {cause}"
    ITEM_UNSEEN_PLACE = "drop.item_unseen_place", "{cause}; the vehicle was not seen as the item passed"
    ITEM_STRAYED = "drop.item_strayed", "the gripper's output went to release away from its item; {cause}"
    ITEM_OPEN_BEFORE = "drop.item_open_before", "the gripper was open before its item"
    ITEM_LATER_RELEASE = "drop.item_later_release", "its item passed unseen, and a later release too"
    ITEM_LATER_GRAB = "drop.item_later_grab", "its item passed unseen, and a later grab too"
    ITEM_AT_GRAB = "drop.item_at_grab", "its item passed, but the gripper's output stayed at grab"
    ITEM_OUTPUT_UNKNOWN = "drop.item_output_unknown", "its item passed, but the gripper's output is not known"
    ITEM_WINCH = "drop.item_winch", "its item passed, and nothing on the link shows what a winch does"
    ITEM_NO_OUTPUT = (
        "drop.item_no_output",
        "its item passed, but no output is assigned to the gripper: nothing was seen to move",
    )
    PLAN_CHANGED = "drop.plan_changed", "the plan was changed in flight"
    PLAN_CHANGED_WHILE_AWAY = (
        "drop.plan_changed_while_away",
        "the plan was changed in flight, and Waydrop restarted meanwhile",
    )

    # returns to a rally point
    RALLY_POINT = (
        "rally.nearest",
        "rally point {rally_point}, {distance_m:.0f} m away: {choice} ({setting})",
    )
    RALLY_POINT_OR = (
        "rally.nearest_or",
        "rally point {rally_point} or {others}, {distance_m:.0f} m away: {choice} ({setting}), "
        "as it is when the return begins",
    )
    RALLY_STAYS_IN_AIR = "rally.stays_in_air", "{cause}; it stays in the air there ({setting})"

    # moving targets
    FEED_SILENT = "target.feed_silent", "nothing was reported by {feed} yet"
    FEED_STALE = "target.stale", "the last report of {feed} is {age_s:.0f} s old"
    FEED_TOO_FAST = (
        "target.too_fast",
        "the target moves at {speed_m_s:.1f} m/s, and {max_speed_m_s:g} m/s are allowed",
    )
    FEED_UNREACHABLE = "target.unreachable", "at {speed_m_s:.3g} m/s the vehicle does not catch up with the target"
    FEED_OUT_OF_BOUNDS = (
        "target.out_of_bounds",
        "they would meet {moved_m:.0f} m from the planned point, and {max_move_m:g} m are allowed",
    )

    # predicted against flown
    NO_RELEASE_SENT = "comparison.no_release_sent", "no release was sent: {cause}"
    NOT_FLOWN = "comparison.not_flown", "not flown: the run ended {state}"
    NOT_FLOWN_YET = "comparison.not_flown_yet", "not flown yet"
    ENDS_UNSEEN = "comparison.ends_unseen", "the vehicle was not seen as it began or ended"
    VISIT_NOT_PREDICTED = "comparison.visit_not_predicted", "this visit was not predicted"
    DROP_NOT_PREDICTED = "comparison.drop_not_predicted", "this drop was not predicted"
    NOT_DROPPED_YET = "comparison.not_dropped_yet", "not dropped yet"
    RELEASE_UNSEEN = "comparison.release_unseen", "the vehicle was not seen at the release"
    PLACE_NOT_PREDICTED = "comparison.place_not_predicted", "on a circle no place is predicted"
    FLOWN_FROM = "comparison.flown_from", "flown from {item_id}"
    ALTERNATE_OF = "comparison.alternate_of", "the alternate of {item_id}"
    RUN_NOT_PREDICTED = "comparison.run_not_predicted", "no prediction was recorded"

    # jobs and the queues of vehicles
    JOB_CANCELLED = "job.cancelled", "cancelled by {actor}"
    JOB_EXPIRED = "job.expired", "its deadline passed before it was started"
    JOB_RUN_NEVER_MADE = "job.run_never_made", "Waydrop stopped before the run was made"
    JOB_STARTED_FIRST = "job.started_first", "it had been started before it could be taken off the vehicle"
    JOB_WAITS_FOR_START = "job.waits_for_start", "it waits for a person's start"
    JOB_START_UNKNOWN = (
        "job.start_unknown",
        "Waydrop stopped as it told the run to start: it does not do so again, a person may start it",
    )
    JOB_IS_TO_END = "job.is_to_end", "the job is to end"
    JOB_NOT_READY = "job.not_ready", "not started yet: {refusal}"
    JOB_RUN_ENDED = "job.run_ended", "its run was ended: {cause}"
    JOB_VEHICLE_FAILED = "job.vehicle_failed", "vehicle {vehicle_id}: {detail}"
    RUN_BAD = "job.run_bad", "run {run_id} ended {state}"
    RUN_BAD_BECAUSE = "job.run_bad_because", "run {run_id} ended {state}: {cause}"
    DROP_BAD = "job.drop_bad", "run {run_id} completed, but drop {plan_item_id} is {outcome}"
    DROP_BAD_BECAUSE = (
        "job.drop_bad_because",
        "run {run_id} completed, but drop {plan_item_id} is {outcome} ({cause})",
    )
    QUEUE_STOPPED = "job.queue_stopped", "stopped by {actor}"
    ONLY_CANDIDATE = "job.only_candidate", "the only one that can"
    CHOSEN = "job.chosen", "chosen of those that can"
    ANOTHER_CHOSEN = "job.another_chosen", "it can too, but {vehicle_id} comes first"

    # offboard control: why it is as it is, or why a lease ended
    OFFBOARD_CHECKING = "offboard.checking", "reading parameters and the fence"
    OFFBOARD_COMMANDING_HOLD = "offboard.commanding_hold", "commanding Hold"
    OFFBOARD_STREAM_FIRST = "offboard.stream_first", "the stream flows before the mode is asked for"
    OFFBOARD_ASKING_MODE = "offboard.asking_mode", "asking for the mode"
    OFFBOARD_ENTRY_BROKEN_OFF = "offboard.entry_broken_off", "the entry was broken off"
    OFFBOARD_LEAVING = "offboard.leaving", "leaving to {to}"
    OFFBOARD_LEAVING_FAILED = "offboard.leaving_failed", "leaving to {to} failed"
    OFFBOARD_LEFT = "offboard.left", "left to {to}"
    OFFBOARD_RELEASED = "offboard.released", "released by its holder"
    OFFBOARD_SOCKET_CLOSED = "offboard.socket_closed", "the client's socket closed"
    OFFBOARD_NOT_RENEWED = "offboard.not_renewed", "not renewed for {lease_s:g} s"
    OFFBOARD_CLIENT_SILENT = "offboard.client_silent", "the client was silent for {silent_s:.1f} s"
    OFFBOARD_LINK_LOST = "offboard.link_lost", "the link to the vehicle is lost"
    OFFBOARD_REBOOTED = "offboard.rebooted", "the vehicle rebooted"
    OFFBOARD_QUARANTINED = "offboard.quarantined", "the vehicle is quarantined"
    OFFBOARD_DISARMED = "offboard.disarmed", "the vehicle disarmed"
    OFFBOARD_COMMANDED = "offboard.commanded", "a person commanded {command}"
    OFFBOARD_FAILSAFE = "offboard.failsafe", "a failsafe acts"
    OFFBOARD_FAILSAFE_MODE = "offboard.failsafe_mode", "the vehicle is in {mode} mode: a failsafe acts"
    OFFBOARD_FAILSAFE_IN_HOLD = "offboard.failsafe_in_hold", "a failsafe acts, in Hold: the next order would end it"
    OFFBOARD_MODE_BY_OTHERS = "offboard.mode_by_others", "the vehicle is in {mode} mode: commanded by somebody else"
    OFFBOARD_HOVERS = "offboard.hovers", "it hovers now, and was flown by commands as a wing"
    OFFBOARD_NOT_GUIDED = (
        "offboard.not_guided",
        "nothing was guided for {silent_s:.1f} s: no fresh position, or no room to circle",
    )
    OFFBOARD_UNANSWERED = "offboard.unanswered", "{count} commands in a row were not answered"
    OFFBOARD_REFUSED = "offboard.refused", "refused {count} times in a row: {detail}"
    OFFBOARD_CANNOT_SEND = "offboard.cannot_send", "cannot send: {detail}"
    OFFBOARD_DEFECT = "offboard.defect", "a defect of the service: nothing more can be sent"
    OFFBOARD_STOOD_STILL = "offboard.stood_still", "the service stood still for {gap_s:.1f} s"
    OFFBOARD_SERVICE_STOPS = "offboard.service_stops", "the service stops"
    OFFBOARD_SERVICE_RESTARTED = "offboard.service_restarted", "the service was restarted"
    OFFBOARD_HOLD_UNCONFIRMED = (
        "offboard.hold_unconfirmed",
        "{cause}; Hold is not confirmed ({detail}): the vehicle's own failsafe acts",
    )
    OFFBOARD_CIRCLE_UNCONFIRMED = (
        "offboard.circle_unconfirmed",
        "{cause}; Hold is not confirmed ({detail}): it circles at its last place",
    )

    # tasks
    TASK_PAUSED = "task.paused", "paused by its client"
    TASK_CLIENT_FLIES = "task.client_flies", "the client sends setpoints itself"
    TASK_LEAVING = "task.leaving", "leaving was asked for"
    TASK_LEAVING_FAILED = "task.leaving_failed", "leaving to {to} failed: {detail}"
    TASK_NONE_LEFT = "task.none_left", "no task is left"
    TASK_ENDED_BEFORE_ANSWER = "task.ended_before_answer", "its task ended before the answer"

    # webhooks
    WEBHOOK_DISABLED = "webhook.disabled", "disabled by {actor}"
    WEBHOOK_GONE = "webhook.gone", "the receiver answered 410 Gone"

    @property
    def parameters(self) -> frozenset[str]:
        """The names that its words need; "cause" among them if it needs one."""
        return frozenset(name for _, name, _, _ in Formatter().parse(self.words) if name)


class Reason(BaseModel):
    """A code, what it is about, and the reason behind it. Compare the code; never the words."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    code: ReasonCode
    params: dict[str, Param] = Field(default_factory=dict)
    cause: Reason | None = None

    @classmethod
    def of(cls, code: ReasonCode, cause: Reason | None = None, /, **params: Param) -> Reason:
        """The reason with this code; `params` are the ones that its words name."""
        return cls(code=code, params=params, cause=cause)

    @classmethod
    def of_error(cls, code: str, detail: str, hint: str = "") -> Reason:
        """An error of ours as a reason: `code` is the error's."""
        if hint:
            return cls.of(ReasonCode.ERROR_WITH_HINT, error=code, detail=detail, hint=hint)
        return cls.of(ReasonCode.ERROR, error=code, detail=detail)

    def __str__(self) -> str:
        """For logs: its code."""
        return self.code.value

    @property
    def codes(self) -> Iterator[ReasonCode]:
        """Its own, then those of what is behind it."""
        yield self.code
        if self.cause is not None:
            yield from self.cause.codes


def describe(reason: Reason | None) -> str:
    """A sentence without its capital and its full stop; empty for None. For people: nothing compares or stores it."""
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


_HEAD = """# Reasons

<!-- Generated from app/domain/reasons.py; `python -m tests.support.regenerate_golden_missions` writes it anew. -->

Why a run, a drop, a job or a queue is as it is comes as a code with parameters, and with the reason behind it where
there is one:

```json
{"code": "drop.item_not_reached", "params": {},
 "cause": {"code": "run.not_heard", "params": {"silent_s": 60.2}, "cause": null}}
```

`null` stands for no reason. Codes are stable: decide by them. The words may change: the page, the command line and the
delivery report make a sentence of them, `{name}` is the parameter of that name and `{cause}` the reason behind. An
`error` is the code of an error of the API in the parameter `error`, with what it said in `detail`. New codes may come
in any release: show what you do not know as it is.

| code | words |
|---|---|
"""


def reasons_page() -> str:
    """Markdown: one line a code."""
    return _HEAD + "".join(f"| `{code.value}` | {code.words} |\n" for code in ReasonCode)


def reason_words() -> str:
    """JSON: the words of each code."""
    return json.dumps({code.value: code.words for code in ReasonCode}, indent=2) + "\n"
