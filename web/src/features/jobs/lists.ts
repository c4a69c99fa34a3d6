/** Which jobs stand where on the page, and in which order. Pure. */

import type { EventKind, Job, JobQueue, JobState, JobUpdate } from "../../api/types";

const OVER: ReadonlySet<JobState> = new Set(["completed", "failed", "cancelled", "expired", "returned"]);
const CANCELLABLE: ReadonlySet<JobState> = new Set(["queued", "preparing", "prepared"]);
const MOST_OVER = 20;

interface JobLists {
  /** With a vehicle now, the oldest first. */
  readonly active: readonly Job[];
  /** The next one first. */
  readonly waiting: readonly Job[];
  /** The newest end first, a few of them. */
  readonly over: readonly Job[];
}

export function groupJobs(jobs: Readonly<Record<string, Job>>): JobLists {
  const all = Object.values(jobs);
  return {
    active: all
      .filter((job) => !hasJobEnded(job) && job.state !== "queued")
      .sort((a, b) => a.created_at - b.created_at),
    waiting: all.filter((job) => job.state === "queued").sort((a, b) => b.priority - a.priority || a.rank - b.rank),
    over: all
      .filter(hasJobEnded)
      .sort((a, b) => (b.ended_at ?? 0) - (a.ended_at ?? 0))
      .slice(0, MOST_OVER),
  };
}

/** What moves a waiting job to another index; null where it stays. It takes the priority of the jobs around it. */
export function moveTo(waiting: readonly Job[], from: number, to: number): JobUpdate | null {
  const [target, below] = [waiting[to], waiting[to + 1]];
  if (target === undefined || from === to || waiting[from] === undefined) return null;
  if (to < from) return { before: target.id };
  return below?.priority === target.priority ? { before: below.id } : { priority: target.priority, place: "last" };
}

export function hasJobEnded(job: Job): boolean {
  return OVER.has(job.state);
}

/** What the service would take; it decides. One that is being taken off its vehicle is not asked again. */
export function isCancellable(job: Job): boolean {
  return CANCELLABLE.has(job.state) && job.end_requested === "";
}

/** It was given to a gateway that does not answer, and has not been started as far as is known. */
export function isClaimClearable(job: Job, isConnected: boolean): boolean {
  const { claim, state } = job;
  return claim !== null && (state === "preparing" || state === "prepared") && !(claim.taken && isConnected);
}

/** It is on its vehicle, and a person starts it. */
export function isReadyToStart(job: Job): boolean {
  return job.state === "prepared" && !job.auto_start && job.end_requested === "";
}

export function stoppedQueues(queues: Readonly<Record<string, JobQueue>>): JobQueue[] {
  return Object.values(queues)
    .filter((queue) => queue.stopped)
    .sort((a, b) => new Intl.Collator("en", { numeric: true }).compare(a.vehicle_id, b.vehicle_id));
}

/** After such an event another vehicle may be able to take a waiting job, or one may no longer be. */
export function affectsAssignment(kind: EventKind): boolean {
  return AFFECTS_ASSIGNMENT[kind] ?? true; // a newer service may send kinds that this page does not know
}

const AFFECTS_ASSIGNMENT: Readonly<Record<EventKind, boolean>> = {
  "service.started": false,
  "service.stopped": false,
  "service.loop_stalled": false,
  "service.site_lease": true,
  "request.accepted": false,
  "vehicle.seen": true,
  "vehicle.link_lost": true,
  "vehicle.link_restored": true,
  "vehicle.changed": true,
  "vehicle.parameters": true,
  "vehicle.rebooted": true,
  "vehicle.status_text": false,
  "vehicle.quarantined": true,
  "vehicle.quarantine_ended": true,
  "vehicle.commanded_in_quarantine": false,
  "vehicle.link_security": false,
  "vehicle.link_key": false,
  "journal.pruned": false,
  "link.refused": false,
  "vehicle.command": false,
  "offboard.lease": true,
  "offboard.changed": false,
  "task.changed": false,
  "task.gripper": false,
  "plan.created": false,
  "run.created": false,
  "run.changed": true,
  "run.predicted": false,
  "run.plan_refused": false,
  "run.upload_progress": false,
  "run.mission_changed": false,
  "run.continued": false,
  "run.taken_over": false,
  "run.target_moved": false,
  "run.target_not_followed": false,
  "run.item": false,
  "run.item_ended": false,
  "run.command": false,
  "run.ack": false,
  "run.drop": false,
  "run.attachment": false,
  "drop.consent_asked": false,
  "drop.consent_closed": false,
  "simulator.fault": false,
  "simulator.speed": false,
  "job.changed": true,
  "job.queue_changed": true,
  "webhook.changed": false,
  "page.missing": false,
};
