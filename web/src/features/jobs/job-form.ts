/** What is typed about a job that is to be queued. Pure. */

import type { JobRequest } from "../../api/types";

interface JobForm {
  readonly vehicle: string;
  readonly priority: string;
  /** Local time, as a datetime-local field has it; empty: none. */
  readonly deadline: string;
  readonly autoStart: boolean;
}

type ParsedJobForm = { readonly order: Omit<JobRequest, "plan" | "wind"> } | { readonly error: string };

const MOST = 100;

export function parseJobForm({ vehicle, priority, deadline, autoStart }: JobForm): ParsedJobForm {
  const rank = /^[+-]?\d+$/.test(priority.trim()) ? Number(priority) : Number.NaN;
  if (!(Math.abs(rank) <= MOST)) return { error: `Enter a whole number from −${MOST} to ${MOST} as the priority.` };
  const latest = deadline === "" ? null : new Date(deadline);
  if (latest !== null && Number.isNaN(latest.getTime())) return { error: "Enter a date and time as the latest start." };
  return { order: { vehicle, priority: rank, deadline: latest?.toISOString() ?? null, auto_start: autoStart } };
}
