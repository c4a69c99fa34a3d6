/**
 * Jobs: read when the page connects, then kept by events. Why one still waits is asked again when something changed.
 */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { Job, JobCandidate, JobsPage } from "../../api/types";
import { reportProblem } from "../../store/notices";
import { panel, selectRun } from "../../store/selection";
import { dispatch, feed, jobs, live, world } from "../../store/store";
import { affectsAssignment, hasJobEnded, moveTo } from "./lists";

/** False until the jobs have been read. */
export const jobsLoaded = signal(false);
/** The job whose candidates are shown. */
export const expandedJob = signal<string | null>(null);
/**
 * The candidates of the expanded job while it waits, and a warning if waiting changes nothing; null until read.
 */
export const jobCandidates = signal<{
  readonly job: string;
  readonly candidates: readonly JobCandidate[];
  readonly warning: string;
} | null>(null);

const PAGE = 200;

export function watchJobs(): void {
  const joined = computed(() => (live.value ? world.value.snapshotSeq : null)); // events up to there are not sent again
  effect(() => {
    if (joined.value !== null) void readJobs();
  });
  const news = computed(() => feed.value.find((event) => affectsAssignment(event.kind))?.position ?? 0);
  const asked = computed(() =>
    live.value &&
    panel.value === "jobs" &&
    expandedJob.value !== null &&
    jobs.value[expandedJob.value]?.state === "queued"
      ? expandedJob.value
      : null,
  );
  effect(() => {
    const [id] = [asked.value, news.value];
    if (id !== null) lookAgain(id);
  });
}

async function readJobs(): Promise<void> {
  try {
    const asked = world.peek();
    const before = Object.values(asked.jobs).filter((job) => !hasJobEnded(job));
    const [open, newest, queues] = await Promise.all([openJobs(), api.jobs({ limit: 20 }), api.jobQueues()]);
    const read = [...open, ...newest.jobs];
    const gone = before.filter(({ id }) => !read.some((job) => job.id === id)); // it ended while the page was offline
    dispatch({ type: "jobs_read", jobs: read, queues: queues.vehicles.map(({ queue }) => queue), gone, asked });
    jobsLoaded.value = true;
  } catch (error) {
    reportProblem("Load the jobs", error);
  }
}

/** All of them: pages begin with the newest, and the oldest ones are flown next. */
async function openJobs(): Promise<Job[]> {
  const found: Job[] = [];
  let next: string | null = null;
  do {
    const answer: JobsPage = await api.jobs({ open: true, limit: PAGE, older_than: next });
    found.push(...answer.jobs);
    next = answer.next;
  } while (next !== null);
  return found;
}

let looking = false;
let again: string | null = null;

/** One question at a time; what changed meanwhile asks once more. */
function lookAgain(id: string): void {
  again = id;
  if (looking) return;
  looking = true;
  void look().finally(() => (looking = false));
}

async function look(): Promise<void> {
  while (again !== null) {
    const id = again;
    again = null;
    try {
      const { candidates, warning } = await api.job(id);
      if (expandedJob.peek() === id) jobCandidates.value = { job: id, candidates, warning };
    } catch (error) {
      reportProblem("Check the vehicles for a job", error);
    }
  }
}

export async function cancelJob(job: Job): Promise<void> {
  await change(`Cancel job “${job.plan_name}”`, async () =>
    dispatch({ type: "jobs_read", jobs: [await api.cancelJob(job.id)], queues: [] }),
  );
}

/** A person knows that its gateway does not fly it: another one may get it. */
export async function clearJobClaim(job: Job): Promise<void> {
  await change(`Clear the claim of job “${job.plan_name}”`, async () =>
    dispatch({ type: "jobs_read", jobs: [await api.clearJobClaim(job.id)], queues: [] }),
  );
}

/** To another place among those that wait: a job that is moved up or down goes around the others. */
export async function moveJob(waiting: readonly Job[], from: number, to: number): Promise<void> {
  const [job, move] = [waiting[from], moveTo(waiting, from, to)];
  if (job === undefined || move === null) return;
  await change(`Move job “${job.plan_name}”`, async () =>
    dispatch({ type: "jobs_read", jobs: [await api.moveJob(job.id, move)], queues: [] }),
  );
}

/** An operator has looked at the vehicle: its next job may follow. */
export async function resumeJobQueue(vehicle: string): Promise<void> {
  await change(`Resume the jobs of ${vehicle}`, async () =>
    dispatch({ type: "jobs_read", jobs: [], queues: [await api.resumeJobQueue(vehicle)] }),
  );
}

async function change(doing: string, act: () => Promise<unknown>): Promise<void> {
  try {
    await act();
  } catch (error) {
    reportProblem(doing, error);
  }
}

export function openJobRun(job: Job): void {
  if (job.run_id !== null) selectRun(job.run_id);
}
