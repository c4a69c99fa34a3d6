/** A job in words: its state, the vehicle that it asks for, when it may start. Pure. */

import type { Job, JobAssignment, JobCandidate, JobState } from "../../api/types";
import { type Tone, vehicleTypeNoun } from "../../format/labels";
import { formatReason } from "../../format/reasons";
import { countOf, humanize, joinParts, toSentence, toSentences } from "../../format/text";
import { formatDistance, formatDuration, formatMoment, formatPercent } from "../../format/units";

const STATES: Readonly<Record<JobState, readonly [string, Tone]>> = {
  queued: ["Queued", "neutral"],
  preparing: ["Uploading", "info"],
  prepared: ["Ready to start", "info"],
  flying: ["Flying", "info"],
  completed: ["Completed", "ok"],
  failed: ["Failed", "danger"],
  cancelled: ["Cancelled", "warn"],
  expired: ["Expired", "warn"],
  returned: ["Given back", "neutral"],
};

export function jobStateLabel(job: Job): string {
  if (job.end_requested !== "") return "Ending";
  if (isUnanswered(job)) return "Waiting for its gateway";
  return STATES[job.state]?.[0] ?? humanize(job.state);
}

export function jobStateTone(job: Job): Tone {
  return job.end_requested === "" && !isUnanswered(job) ? (STATES[job.state]?.[1] ?? "neutral") : "warn";
}

/** The gateway that it was given to has not said whether it has it. */
function isUnanswered({ state, claim }: Job): boolean {
  return state === "preparing" && claim !== null && !claim.taken;
}

/** "Assigned to v1", or the vehicles that it may have. */
export function describeJobVehicle({ vehicle_id, vehicle_type, selector }: Job): string {
  if (vehicle_id !== null) return `Assigned to ${vehicle_id}`;
  if (selector.vehicle !== "any") return `For ${selector.vehicle}`;
  const allowed = selector.allowed_vehicles;
  return allowed.length > 0 ? `For ${allowed.join(" or ")}` : `For any ${vehicleTypeNoun(vehicle_type)}`;
}

/** When and how it starts, and what it asks for; `now` in Unix seconds, null while the service's time is unknown. */
export function describeJobStart(job: Job, now: number | null): string[] {
  const today = now === null ? "" : new Date(now * 1000).toDateString();
  if (job.ended_at !== null) return [`ended ${formatMoment(job.ended_at, today)}`];
  const { not_before, deadline, selector } = job;
  const isEarly = not_before !== null && (now === null || now < not_before);
  return [
    isEarly ? `not before ${formatMoment(not_before, today)}` : "",
    deadline === null ? "" : `start by ${formatMoment(deadline, today)}${timeLeft(deadline, now)}`,
    job.state === "flying" ? "" : job.auto_start ? "starts automatically" : "starts manually",
    job.priority === 0 ? "" : `priority ${job.priority}`,
    job.state === "queued" && selector.min_battery_percent > 0
      ? `battery at least ${formatPercent(selector.min_battery_percent)}`
      : "",
  ].filter((part) => part !== "");
}

function timeLeft(deadline: number, now: number | null): string {
  if (now === null) return "";
  return deadline > now ? ` (in ${formatDuration(Math.round(deadline - now))})` : " (overdue)";
}

/** Why a vehicle was chosen or is suitable, or each reason why it is not. */
export function describeCandidate(candidate: JobCandidate): string[] {
  const { refusals, omitted_refusals: more, reason, distance_m } = candidate;
  if (refusals.length === 0) {
    const away = distance_m === null ? "" : `${formatDistance(distance_m)} from the start`;
    return [toSentence(joinParts([formatReason(reason) || "available", away], ", "))];
  }
  const reasons = refusals.map(({ message, reason: cause, hint }) =>
    toSentences(cause === null ? message : `${message}: ${formatReason(cause)}`, hint),
  );
  return more > 0 ? [...reasons, `${countOf(more, "more reason")}.`] : reasons;
}

/** What becomes of a job that is queued now. */
export function describeAssignment({ vehicle_id, warning }: JobAssignment): { text: string; tone: Tone } {
  if (vehicle_id !== null) return { text: `${vehicle_id} would take this job now.`, tone: "ok" };
  if (warning === "") return { text: "No vehicle can take this job now: it waits in the queue.", tone: "info" };
  return { text: `${NO_VEHICLE_EVER} Change the plan first.`, tone: "warn" };
}

export const NO_VEHICLE_EVER = "No vehicle can fly this job as it is, and waiting does not change that.";
