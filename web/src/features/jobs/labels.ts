/** A job in words: its state, what it asks for, when it may start. Pure. */

import type { Job, JobCandidate, JobState } from "../../api/types";
import { fullSentence, plain, type Tone, vehicleTypeName } from "../../format/labels";
import { reasonWords } from "../../format/reasons";
import { clockTime, distance, percent, seconds } from "../../format/units";

const STATES: Readonly<Record<JobState, readonly [string, Tone]>> = {
  queued: ["Waits", "neutral"],
  preparing: ["Uploading", "info"],
  prepared: ["Ready to start", "info"],
  flying: ["Flying", "info"],
  completed: ["Completed", "ok"],
  failed: ["Failed", "danger"],
  cancelled: ["Cancelled", "warn"],
  expired: ["Expired", "warn"],
};

export function jobStateName(job: Job): string {
  if (job.end_asked !== "") return "Is taken off";
  return STATES[job.state]?.[0] ?? plain(job.state);
}

export function jobStateTone(job: Job): Tone {
  return job.end_asked === "" ? (STATES[job.state]?.[1] ?? "neutral") : "warn";
}

/** "Given to v1", or which ones it may have. */
export function vehicleWords({ vehicle_id: given, vehicle_type: type, wish }: Job): string {
  if (given !== null) return `Given to ${given}`;
  if (wish.vehicle !== "any") return `For ${wish.vehicle}`;
  const allowed = wish.allowed_vehicles;
  return allowed.length > 0
    ? `For ${allowed.join(" or ")}`
    : `For any ${vehicleTypeName(type).replace(/^[A-Z](?![A-Z])/, (letter) => letter.toLowerCase())}`;
}

/**
 * When and by whom it is started, and what it asks for; `now` in Unix seconds, null if the service's time is not
 * known.
 */
export function startWords(job: Job, now: number | null): string[] {
  if (job.ended_at !== null) return [`ended ${clockTime(job.ended_at)}`];
  return [
    job.not_before !== null && (now === null || now < job.not_before) ? `not before ${clockTime(job.not_before)}` : "",
    job.deadline === null ? "" : `to start by ${clockTime(job.deadline)}${left(job.deadline, now)}`,
    job.state === "flying" ? "" : job.auto_start ? "starts by itself" : "a person starts it",
    job.priority === 0 ? "" : `priority ${job.priority}`,
    job.wish.min_battery_percent > 0 && job.state === "queued"
      ? `battery from ${percent(job.wish.min_battery_percent)}`
      : "",
  ].filter((part) => part !== "");
}

function left(deadline: number, now: number | null): string {
  if (now === null) return "";
  return deadline > now ? ` (in ${seconds(Math.round(deadline - now))})` : " (over)";
}

/** Why a vehicle was chosen or may be, or each reason why it cannot have the job. */
export function candidateWords(candidate: JobCandidate): string[] {
  const { refusals, refusals_left_out: more, reason, distance_m: away } = candidate;
  if (refusals.length > 0)
    return [
      ...refusals.map(
        ({ message, reason: behind, hint }) =>
          fullSentence(message + (behind ? `: ${reasonWords(behind)}` : "")) +
          (hint === "" ? "" : ` ${fullSentence(hint)}`),
      ),
      ...(more > 0 ? [`And ${more} more.`] : []),
    ];
  return [
    fullSentence(
      [reasonWords(reason) || "nothing speaks against it", away === null ? "" : `${distance(away)} from the start`]
        .filter((part) => part !== "")
        .join(", "),
    ),
  ];
}
