/** Events of jobs and of vehicles' queues as sentences. Pure. */

import type { EventOf, JobState } from "../api/types";
import { reasonWords } from "./reasons";
import type { Sentence } from "./sentences";
import type { Tone } from "./words";

type JobChange = EventOf<"job.changed">["data"]["change"];

const WORDS: Readonly<Record<Exclude<JobChange, "ended">, string>> = { queued: "waits", placed: "has another place", assigned: "is given to", requeued: "waits again", prepared: "is prepared on", start_asked: "is started on", started: "flies with", end_asked: "is taken off", noted: "waits on" };
const WITH_VEHICLE: ReadonlySet<JobChange> = new Set(["assigned", "prepared", "start_asked", "started", "end_asked", "noted"]);
const END_TONES: Partial<Record<JobState, Tone>> = { completed: "ok", failed: "danger", expired: "warn" };

export function sayJob(event: EventOf<"job.changed">): Sentence {
  const { change, job } = event.data;
  const what = change === "ended" ? `is ${job.state}` : WORDS[change];
  const vehicle = WITH_VEHICLE.has(change) ? ` ${event.vehicle_id ?? "its vehicle"}` : "";
  const tone = change === "ended" ? (END_TONES[job.state] ?? "neutral") : "info";
  return { text: `Job “${job.plan_name}” ${what}${vehicle}${job.reason === null ? "" : `: ${reasonWords(job.reason)}`}.`, tone };
}

export function sayJobQueue({ data: { change, queue } }: EventOf<"job.queue_changed">, vehicle: string): Sentence {
  if (queue.stopped) return { text: `The job queue of ${vehicle} is stopped: ${reasonWords(queue.reason)}.`, tone: "danger" };
  return { text: `The job queue of ${vehicle} goes on${change === "resumed" && queue.actor !== "" ? `, says ${queue.actor}` : ""}.`, tone: "info" };
}
