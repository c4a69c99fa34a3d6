"""Events: facts that happened, numbered without gaps by the gateway that saw them, stored before they are sent."""

from __future__ import annotations

from enum import StrEnum
from typing import Any

from pydantic import BaseModel, ConfigDict


class EventKind(StrEnum):
    """What an event says. The data of each kind is documented here; it is what the stream carries."""

    SERVICE_STARTED = "service.started"
    """data: version."""
    SERVICE_STOPPED = "service.stopped"
    """data: empty."""
    VEHICLE_SEEN = "vehicle.seen"
    """data: system_id, vehicle_type, uid, firmware, connection."""
    VEHICLE_LINK_LOST = "vehicle.link_lost"
    """data: last_heartbeat_age_s."""
    VEHICLE_LINK_RESTORED = "vehicle.link_restored"
    """data: empty."""
    VEHICLE_CHANGED = "vehicle.changed"
    """data: mode, armed, landed, in_failsafe, vtol_state."""
    VEHICLE_PARAMETERS = "vehicle.parameters"
    """data: parameters (name: value). Those that Waydrop uses and that have another value now: somebody set them."""
    VEHICLE_REBOOTED = "vehicle.rebooted"
    """data: empty. The vehicle's boot time jumped back."""
    VEHICLE_STATUS_TEXT = "vehicle.status_text"
    """data: severity (MAV_SEVERITY word), text."""
    VEHICLE_QUARANTINED = "vehicle.quarantined"
    """data: reason. No command is sent to it until it is released."""
    VEHICLE_COMMAND = "vehicle.command"
    """data: command, params, by, outcome. A command that a user gave outside a run (hold, return, land)."""
    OFFBOARD_LEASE = "offboard.lease"
    """data: change (taken, handed_over, overridden, offered, released, expired, revoked), holder, reason."""
    OFFBOARD_CHANGED = "offboard.changed"
    """data: state, holder, reason. The setpoints themselves are telemetry."""
    TASKS_CHANGED = "tasks.changed"
    """data: change (inserted, changed, moved, removed, reached, time_over, gripper_done, skipped, cleared, paused,
    resumed, by_hand, blocked, dropped), task_id, task, holder, reason, task_list."""
    TASKS_GRIPPER = "tasks.gripper"
    """data: task_id, action, result ("sent", then ACCEPTED or why not)."""
    PLAN_CREATED = "plan.created"
    """data: plan_id, hash, name, vehicle_type, created_at, created_by."""
    RUN_CREATED = "run.created"
    """data: the whole run."""
    RUN_CHANGED = "run.changed"
    """data: the whole run."""
    RUN_PREDICTED = "run.predicted"
    """data: the timeline for this vehicle, as predicted before the flight; at most its first 500 visits."""
    RUN_PLAN_REFUSED = "run.plan_refused"
    """data: code, findings, parameters_age_s (s, null if they were not read since the link was lost). The check at a
    start found errors, by the parameters as they were then; the vehicle was not armed."""
    RUN_UPLOAD_PROGRESS = "run.upload_progress"
    """data: mission_type, sent, total, attempt, percent."""
    RUN_MISSION_CHANGED = "run.mission_changed"
    """data: change (see Run.change) and timeline, as predicted for the rest. The vehicle has the changed mission."""
    RUN_CONTINUED = "run.continued"
    """data: the whole run, which is over; `continued_by` flies what was left. Stored together with that run."""
    RUN_TARGET_MOVED = "run.target_moved"
    """data: plan_item_id, waypoint_id, plan_id (the run flies it now), moved_from, moved_to, from_planned_m, after_s
    (when the target is there), target (see DropRecord.target)."""
    RUN_TARGET_NOT_FOLLOWED = "run.target_not_followed"
    """data: plan_item_id, waypoint_id, feed, code, reason, target (null if nothing was reported yet). The waypoint
    stays where it is. Told once for each new code."""
    RUN_ITEM = "run.item"
    """data: item_id, seq, what ("current" | "reached")."""
    RUN_ITEM_ENDED = "run.item_ended"
    """data: item_id, began_s, ended_s (the vehicle's own clock, seconds since it started; null if nobody saw it), and
    paused_s of them, in which the run was paused."""
    RUN_COMMAND = "run.command"
    """data: command, params, attempt. Stored before it is sent."""
    RUN_ACK = "run.ack"
    """data: command, result (MAV_RESULT word), result_code, progress."""
    RUN_DROP = "run.drop"
    """data: the drop record."""
    RUN_ATTACHMENT = "run.attachment"
    """data: plan_item_id, name, media_type, size_bytes, sha256, at, by. The file itself lies beside the journal."""
    DROP_CONSENT_ASKED = "drop.consent_asked"
    """data: plan_item_id, question, deadline_at, checked (offset, altitude, battery ...). The vehicle holds."""
    DROP_CONSENT_CLOSED = "drop.consent_closed"
    """data: plan_item_id, question, state (granted, refused, timed_out, withdrawn), by, reason. A grant is stored
    before a release is sent."""
    SIMULATOR_FAULT = "simulator.fault"
    """data: fault, value, by, problem. Stored before the simulated vehicle gets the fault, with problem null; once more
    with the reason when it did not."""
    SIMULATOR_SPEED = "simulator.speed"
    """data: speed, by, problem. Stored before the simulator gets it, with problem null; once more with the reason when
    it did not."""
    JOB_CHANGED = "job.changed"
    """data: change (queued, placed, assigned, requeued, prepared, start_asked, started, end_asked, noted, ended), by,
    job (the whole job)."""
    JOB_QUEUE_CHANGED = "job.queue_changed"
    """data: change (stopped, resumed, cleared), queue (vehicle_id, stopped, reason, by, at, cleared_run_id)."""
    WEBHOOK_CHANGED = "webhook.changed"
    """data: webhook_id, change (created, changed, enabled, disabled, deleted), host, by, reason."""


class NewEvent(BaseModel):
    """An event before the journal has numbered it. `time` is Unix seconds. `data` is JSON-able."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: EventKind
    time: float
    vehicle_id: str | None = None
    run_id: str | None = None
    data: dict[str, Any] = {}


class Event(NewEvent):
    """A stored event. `seq` starts at 1 and has no gaps within one gateway's journal.

    `hash` is its link of the journal's chain (journal_chain.py): keep it, and it proves what the journal said.
    """

    seq: int
    gateway: str
    hash: str
