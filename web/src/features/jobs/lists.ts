/** Which jobs stand where on the page, and in which order. Pure. */

import type { Job, JobQueue, JobState } from "../../api/types";

const OVER: ReadonlySet<JobState> = new Set(["completed", "failed", "cancelled", "expired"]);
const CANCELLABLE: ReadonlySet<JobState> = new Set(["queued", "preparing", "prepared"]);
const MOST_OVER = 20;

export interface JobLists {
  /** With a vehicle now, the oldest first. */
  readonly active: readonly Job[];
  /** The next one first. */
  readonly waiting: readonly Job[];
  /** The newest end first, a few of them. */
  readonly over: readonly Job[];
}

export function jobLists(jobs: Readonly<Record<string, Job>>): JobLists {
  const all = Object.values(jobs);
  return {
    active: all.filter((job) => !isOver(job) && job.state !== "queued").sort((a, b) => a.created_at - b.created_at),
    waiting: all.filter((job) => job.state === "queued").sort((a, b) => b.priority - a.priority || a.rank - b.rank),
    over: all
      .filter(isOver)
      .sort((a, b) => (b.ended_at ?? 0) - (a.ended_at ?? 0))
      .slice(0, MOST_OVER),
  };
}

export function isOver(job: Job): boolean {
  return OVER.has(job.state);
}

/** What the service would take; it decides. One that is being taken off its vehicle is not asked again. */
export function isCancellable(job: Job): boolean {
  return CANCELLABLE.has(job.state) && job.end_asked === "";
}

export function stoppedQueues(queues: Readonly<Record<string, JobQueue>>): JobQueue[] {
  return Object.values(queues)
    .filter((queue) => queue.stopped)
    .sort((a, b) => new Intl.Collator("en", { numeric: true }).compare(a.vehicle_id, b.vehicle_id));
}

/** Events after which another vehicle may be able to take what waits, or one no more. */
export function mayChangeChoice(kind: string): boolean {
  return /^(vehicle\.(?!status_text|command)|job\.|run\.changed|offboard\.lease)/.test(kind);
}
