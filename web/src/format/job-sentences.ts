/** Events of jobs and of vehicles' queues as sentences. Pure. */

import type { StreamEvent } from "../api/types";
import type { Sentence } from "./sentences";
import type { Tone } from "./words";

const WORDS: Readonly<Record<string, string>> = { queued: "waits", placed: "has another place", assigned: "is given to", requeued: "waits again", prepared: "is prepared on", start_asked: "is started on", started: "flies with", end_asked: "is taken off", noted: "waits on" };
const WITH_VEHICLE: ReadonlySet<string> = new Set(["assigned", "prepared", "start_asked", "started", "end_asked", "noted"]);
const END_TONES: Readonly<Record<string, Tone>> = { completed: "ok", failed: "danger", expired: "warn" };

export function sayJob(event: StreamEvent): Sentence {
  const job = part(event.data["job"]);
  const change = text(event.data["change"]);
  const state = text(job["state"]);
  const what = change === "ended" ? `is ${state}` : (WORDS[change] ?? "changed");
  const vehicle = WITH_VEHICLE.has(change) ? ` ${event.vehicle_id ?? "its vehicle"}` : "";
  const reason = text(job["reason"]);
  const tone = change === "ended" ? (END_TONES[state] ?? "neutral") : "info";
  return { text: `Job “${text(job["plan_name"])}” ${what}${vehicle}${reason === "" ? "" : `: ${reason}`}.`, tone };
}

export function sayJobQueue(event: StreamEvent, vehicle: string): Sentence {
  const queue = part(event.data["queue"]);
  if (queue["stopped"] === true) return { text: `The job queue of ${vehicle} is stopped: ${text(queue["reason"])}.`, tone: "danger" };
  const by = text(queue["by"]);
  return { text: `The job queue of ${vehicle} goes on${event.data["change"] === "resumed" && by !== "" ? `, says ${by}` : ""}.`, tone: "info" };
}

function part(value: unknown): Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function text(value: unknown): string {
  return typeof value === "string" ? value : "";
}
