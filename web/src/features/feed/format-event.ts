/** Each event of the stream as a sentence that can be read aloud. Unknown kinds still say what they are. Pure. */

import type { EventKind, EventOf, InsertMode, JobState, ReasonCode, Run, StreamEvent } from "../../api/types";
import {
  asSentence,
  certaintyName,
  consentWords,
  plain,
  restsOnAckAlone,
  runStateName,
  runStateTone,
  type Tone,
} from "../../format/labels";
import { reasonWords } from "../../format/reasons";
import { distance, percent, seconds } from "../../format/units";
import { taskSummary, taskTitle, toldTask } from "../tasks/labels";

export interface Sentence {
  readonly text: string;
  readonly tone: Tone;
}

/** The name of a stored plan; null if it is not known. */
export type PlanName = (plan_id: string) => string | null;

type Say<K extends EventKind> = (event: EventOf<K>, vehicle: string, planName: PlanName) => Sentence;

/** A kind without its words is an error of types. */
const SAY: { readonly [K in EventKind]: Say<K> } = {
  "service.started": (e) => ({
    text: `The service started${after(" (version ", e.data.release, ")")}.`,
    tone: "neutral",
  }),
  "service.stopped": () => ({ text: "The service stopped.", tone: "warn" }),
  "request.accepted": (e) => ({
    text: `${plain(str(e.data.action))}, asked for by ${str(e.data.actor)}.`,
    tone: "neutral",
  }),
  "service.loop_stalled": (e) => ({ text: `The service stood still for ${seconds(e.data.delay_s)}.`, tone: "warn" }),
  "vehicle.seen": (e, v) => ({
    text: `${v} was seen${after(": ", lower(e.data.vehicle_type))}${after(", firmware ", e.data.firmware)}.`,
    tone: "info",
  }),
  "vehicle.link_lost": (_, v) => ({ text: `The link to ${v} is lost.`, tone: "danger" }),
  "vehicle.link_restored": (_, v) => ({ text: `The link to ${v} is back.`, tone: "ok" }),
  "vehicle.changed": sayChanged,
  "vehicle.parameters": (e, v) => ({
    text: `Parameters of ${v} were changed: ${settings(e.data.parameters)}.`,
    tone: "warn",
  }),
  "vehicle.rebooted": (_, v) => ({ text: `${v} rebooted.`, tone: "danger" }),
  "vehicle.status_text": (e, v) => ({
    text: `${v} says: “${str(e.data.text)}”${e.data.repeated ? ` (${e.data.repeated} times more)` : ""}`,
    tone: SEVERITY_TONES[e.data.severity] ?? "neutral",
  }),
  "vehicle.quarantined": (e, v) => ({ text: `${v} is quarantined: ${reasonWords(e.data.reason)}.`, tone: "danger" }),
  "vehicle.link_security": (e, v) => ({
    text: `The link to ${v} is ${e.data.security} now.`,
    tone: e.data.security === "open" ? "warn" : "info",
  }),
  "vehicle.link_key": sayLinkKey,
  "link.refused": sayRefused,
  "vehicle.command": (e, v) => ({
    text: `${v} was told to ${lower(e.data.command)}${after(" by ", e.data.actor)}: ${e.data.outcome}${after(", ", reasonWords(e.data.reason))}.`,
    tone: e.data.outcome === "failed" ? "warn" : "info",
  }),
  "offboard.lease": sayLease,
  "offboard.changed": sayOffboard,
  "task.changed": sayTasks,
  "task.gripper": (e, v) => ({
    text: `${v}, task ${str(e.data.task_id)}, ${lower(e.data.action)}: ${e.data.outcome}${after(", ", reasonWords(e.data.reason))}.`,
    tone: e.data.outcome === "sent" || e.data.outcome === "done" ? "drop" : "danger",
  }),
  "plan.created": (e) => ({ text: `Plan “${str(e.data.name)}” was stored.`, tone: "neutral" }),
  "run.created": (e, v, name) => ({ text: `${runWords(e.data, name)} was created for ${v}.`, tone: "neutral" }),
  "run.changed": sayRun,
  "run.upload_progress": sayUpload,
  "run.mission_changed": (e, v) => ({
    text: `${v} flies on with a changed plan, from “${str(e.data.change.continue_at)}”${after(", ordered by ", e.data.change.actor)}.`,
    tone: "info",
  }),
  "run.continued": (e, v, name) => ({
    text: `What was left of ${lowerFirst(runWords(e.data, name))} of ${v} is flown by run ${short(str(e.data.continued_by))}.`,
    tone: "info",
  }),
  "run.target_moved": (e, v) => ({
    text: `${v} follows a moving target: “${str(e.data.waypoint_id)}” is now ${distance(e.data.from_planned_m)} from where it was planned.`,
    tone: "info",
  }),
  "run.target_not_followed": (e, v) => ({
    text: `${v} does not follow its moving target: ${reasonWords(e.data.reason)}.`,
    tone: "warn",
  }),
  "run.plan_refused": (e, v) => ({
    text: `Run ${short(e.run_id)} was not started: ${v}, as it is set now, would not fly its plan.`,
    tone: "danger",
  }),
  "run.item": (e, v) => ({
    text: `${v} ${e.data.phase === "reached" ? "has done" : "is on its way to"} “${str(e.data.item_id)}”.`,
    tone: "info",
  }),
  "run.predicted": (e, v) => ({
    text: `Predicted for ${v}: ${seconds(e.data.duration_s)} in flight.`,
    tone: "neutral",
  }),
  "run.item_ended": (e, v) => ({
    text: `“${str(e.data.item_id)}” took ${v} ${seconds(took(e.data))}.`,
    tone: "neutral",
  }),
  "run.command": (e, v) => ({ text: `Sent ${command(e.data.command)} to ${v}${again(e.data.attempt)}.`, tone: "drop" }),
  "run.ack": sayAck,
  "run.drop": sayDrop,
  "drop.consent_asked": (e, v) => ({
    text: `${v} holds at “${str(e.data.plan_item_id)}” and waits for an operator's consent.`,
    tone: "warn",
  }),
  "drop.consent_closed": sayConsent,
  "run.attachment": (e) => ({
    text: `“${str(e.data.name)}” was attached to “${str(e.data.plan_item_id)}”${after(" by ", e.data.actor)}.`,
    tone: "info",
  }),
  "webhook.changed": (e) => ({
    text: `A webhook to ${str(e.data.host)} was ${lower(e.data.change)}${after(" by ", e.data.actor)}.`,
    tone: e.data.change === "disabled" ? "warn" : "neutral",
  }),
  "job.changed": sayJob,
  "job.queue_changed": sayJobQueue,
  "simulator.fault": sayFault,
  "simulator.speed": saySpeed,
  "page.missing": (e) => ({
    text: `Events ${str(e.data.first)} to ${str(e.data.last)} are no longer kept by the service.`,
    tone: "warn",
  }),
};

/** Runs are named by their plans, where these are known, else by their ids. */
export function sentence(event: StreamEvent, planName: PlanName = () => null): Sentence {
  const vehicle = event.vehicle_id ?? "A vehicle";
  const say = SAY[event.kind] as Say<EventKind> | undefined; // a newer service may tell more than this page knows
  return (
    say?.(event as never, vehicle, planName) ?? { text: `${plain(event.kind.replaceAll(".", " "))}.`, tone: "neutral" }
  );
}

function settings(parameters: Readonly<Record<string, number>>): string {
  return Object.entries(parameters)
    .map(([name, value]) => `${name} ${value}`)
    .join(", ");
}

function sayLinkKey(event: EventOf<"vehicle.link_key">, vehicle: string): Sentence {
  const { outcome, actor, fingerprint, reason } = event.data;
  if (outcome === "done")
    return { text: `${vehicle} signs with a new key${after(" (", fingerprint)}), given by ${actor}.`, tone: "info" };
  if (outcome === "failed")
    return { text: `${vehicle} did not take its new key${after(": ", reasonWords(reason))}.`, tone: "warn" };
  return { text: `${actor} sends ${vehicle} a new signing key.`, tone: "info" };
}

const REFUSAL_WORDS: Readonly<Record<EventOf<"link.refused">["data"]["refusal"], string>> = {
  peer_not_allowed: "from an address that is not allowed",
  other_peer: "for a vehicle that is heard from another address",
  system_not_allowed: "of a system id that is not allowed",
  too_many_systems: "of more system ids than the connection takes",
  unsigned: "without a signature",
  bad_signature: "with a signature of no known key",
  old_timestamp: "that were signed earlier than what was heard before",
  other_link_id: "that were signed on another link of the vehicle",
  too_fast: "of a vehicle that sends too many",
  texts: "with more status texts than anybody can read",
  late: "that came too late, because the service stood still",
  congested: "to a vehicle whose link is full",
  not_announced: "before a heartbeat",
  ground_station: "of another ground station",
  damaged: "that were damaged",
};

function sayRefused(event: EventOf<"link.refused">): Sentence {
  const { refusal, count, connections, peer, systems } = event.data;
  const claimed = systems.length > 0 ? `, system ${systems.join(", ")}` : "";
  const words = REFUSAL_WORDS[refusal] ?? plain(refusal); // a newer service may know more reasons
  return {
    text: `${count} ${count === 1 ? "frame was" : "frames were"} refused on ${connections.join(", ")}, ${words} (the newest from ${peer}${claimed}).`,
    tone: "warn",
  };
}

const LEASE_WORDS: Readonly<Record<EventOf<"offboard.lease">["data"]["change"], string>> = {
  acquired: "has the offboard lease of",
  handed_over: "took over the offboard lease of",
  overridden: "overrode the offboard lease of",
  offered: "offers the offboard lease of",
  released: "gave back the offboard lease of",
  expired: "let the offboard lease expire of",
  revoked: "lost the offboard lease of",
};

function sayLease(event: EventOf<"offboard.lease">, vehicle: string): Sentence {
  const { change } = event.data;
  const words = LEASE_WORDS[change] ?? "changed the offboard lease of"; // a newer service may know more changes
  const tone = change === "revoked" || change === "expired" ? "warn" : "info";
  return {
    text: `${str(event.data.holder)} ${words} ${vehicle}${otherHolder(event.data)}${after(": ", reasonWords(event.data.reason))}.`,
    tone,
  };
}

/** Who had the lease before, or is to have it. */
function otherHolder({ change, other }: EventOf<"offboard.lease">["data"]): string {
  if (change === "offered") return other ? ` to ${other}` : ": the offer is withdrawn";
  return other ? `: ${other} had it` : "";
}

function sayOffboard(event: EventOf<"offboard.changed">, vehicle: string): Sentence {
  const state = str(event.data.state);
  return {
    text: `${vehicle}, offboard control: ${state}${after(", ", reasonWords(event.data.reason))}.`,
    tone: state === "active" ? "warn" : "neutral",
  };
}

type TaskChange = EventOf<"task.changed">["data"]["change"];

const TASK_WORDS: Readonly<Record<TaskChange, string>> = {
  inserted: "is queued",
  changed: "was changed",
  cleared: "was taken out",
  reached: "has come to its end",
  time_over: "has lasted its time",
  gripper_done: "has worked the gripper",
  skipped: "was skipped",
  moved: "has another place in the queue",
  removed: "was taken out",
  paused: "is paused",
  resumed: "goes on",
  manual: "waits: its pilot has manual control",
  blocked: "is stopped",
  dropped: "and what came after it are dropped",
};

const QUEUED: Readonly<Record<InsertMode, string>> = {
  append: " at the end of the queue",
  prepend: " before the current one",
  replace_current: " in place of the current one",
  replace_all: " in place of all others",
};

function sayTasks(event: EventOf<"task.changed">, vehicle: string): Sentence {
  const { change, insert_mode: mode } = event.data;
  const id = event.data.task_id;
  const tone = change === "blocked" || change === "dropped" ? "warn" : "info";
  const task = change === "changed" ? toldTask(event.data.task) : null;
  if (task !== null)
    return { text: `${vehicle}: task ${str(id)} was changed to: ${taskTitle(task)}, ${taskSummary(task)}.`, tone };
  if (change === "inserted" && typeof id === "string")
    return { text: `${vehicle}: task ${id} is queued${(mode && QUEUED[mode]) ?? ""}.`, tone };
  const what =
    typeof id === "string"
      ? `task ${id} ${TASK_WORDS[change] ?? "changed"}`
      : `the task queue ${change === "cleared" || change === "dropped" ? `was ${change}` : "changed"}`;
  return { text: `${vehicle}: ${what}${after(": ", reasonWords(event.data.reason))}.`, tone };
}

function sayChanged(event: EventOf<"vehicle.changed">, vehicle: string): Sentence {
  const { mode, armed, landed, in_failsafe: failsafe } = event.data;
  if (failsafe === true) return { text: `${vehicle} is in failsafe${after(", mode ", lower(mode))}.`, tone: "danger" };
  const parts = [
    typeof mode === "string" ? `${lower(mode)} mode` : "",
    armed === true ? "armed" : armed === false ? "disarmed" : "",
    landed === "undefined" ? "" : lower(landed),
  ].filter((part) => part !== "");
  return { text: `${vehicle}: ${parts.join(", ") || "changed"}.`, tone: "neutral" };
}

/** A return for one of these is how a flight should end. */
const PLANNED_ENDS: ReadonlySet<ReasonCode> = new Set<ReasonCode>(["run.mission_done", "run.on_ground"]);

/** Of an event with the whole run. */
function runWords({ id, plan_id }: Run, planName: PlanName): string {
  const name = planName(plan_id);
  return name === null ? `Run ${short(id)}` : `“${name}”`;
}

function sayRun({ data: run }: EventOf<"run.changed">, _: string, planName: PlanName): Sentence {
  const of = `${runWords(run, planName)} of ${run.vehicle_id}`;
  if (run.state === "paused" && run.reason?.code === "run.resuming_as_asked")
    return { text: `${of} is told to go on.`, tone: "info" };
  const reason = run.reason ? ` ${ended(asSentence(reasonWords(run.reason)))}` : "";
  const planned = run.state === "returning" && run.reason !== null && PLANNED_ENDS.has(run.reason.code);
  return {
    text: `${of}: ${runStateName(run.state).toLowerCase()}.${reason}`,
    tone: planned ? "info" : runStateTone(run.state),
  };
}

function sayUpload(
  { data: { mission_type: list, sent, total } }: EventOf<"run.upload_progress">,
  vehicle: string,
): Sentence {
  return { text: `Uploading the ${lower(list)} to ${vehicle}: ${sent} of ${total}.`, tone: "info" };
}

/** What the vehicle answered, or what became of a command that has no answer of its own. */
function sayAck({ data }: EventOf<"run.ack">, vehicle: string): Sentence {
  const what = command(data.command);
  if (data.outcome !== "acknowledged")
    return {
      text: `${what}, ${vehicle}: ${OUTCOMES[data.outcome]}${after(": ", data.detail)}.`,
      tone: data.outcome === "done" ? "ok" : "danger",
    };
  const progress = data.result === "IN_PROGRESS" && data.progress ? ` (${percent(data.progress)})` : "";
  return {
    text: `${vehicle} answered ${what}: ${data.result === null ? `MAV_RESULT ${str(data.result_code)}` : lower(data.result)}${progress}.`,
    tone: data.result === "ACCEPTED" ? "ok" : data.result === "IN_PROGRESS" ? "info" : "danger",
  };
}

const OUTCOMES = {
  done: "done",
  failed: "failed",
  not_sent: "not sent",
  unknown: "nobody saw whether it was done",
} as const;

function sayDrop({ data: drop }: EventOf<"run.drop">, vehicle: string): Sentence {
  const reason = drop.reason ? ` ${ended(asSentence(reasonWords(drop.reason)))}` : "";
  const item = drop.plan_item_id;
  switch (drop.outcome) {
    case "released":
      if (restsOnAckAlone(drop))
        return { text: `${vehicle} acknowledged the release of “${item}”; no output was seen to move.`, tone: "warn" };
      return {
        text: `${vehicle} released “${item}”${after(", ", certaintyName(drop.certainty))}.${reason}`,
        tone: "ok",
      };
    case "kept":
      return { text: `${vehicle} kept “${item}” on board.${reason}`, tone: "warn" };
    case "unknown":
      return { text: `Whether ${vehicle} released “${item}” is not known.${reason}`, tone: "danger" };
    default:
      if (drop.output_evidence === "not_assigned")
        return { text: `Drop “${item}”: ${lower(drop.phase)}. No output is assigned to the gripper.`, tone: "warn" };
      return { text: `Drop “${item}”: ${lower(drop.phase)}.`, tone: "drop" };
  }
}

function sayConsent(event: EventOf<"drop.consent_closed">): Sentence {
  const { plan_item_id: item, state, actor, comment, reason } = event.data;
  const words = consentWords({ state, answered_by: actor, comment, reason });
  return { text: `“${str(item)}”: ${ended(words)}`, tone: state === "granted" ? "ok" : "warn" };
}

function sayFault(event: EventOf<"simulator.fault">, vehicle: string): Sentence {
  const { fault, value, actor, problem } = event.data;
  const what = `Simulated fault ${str(fault)} = ${JSON.stringify(value ?? null)} for ${vehicle}${after(" by ", actor)}`;
  const why = str(problem);
  return why === ""
    ? { text: `${what}.`, tone: "warn" }
    : { text: `${what} was not set: ${ended(why)}`, tone: "danger" };
}

function saySpeed(event: EventOf<"simulator.speed">): Sentence {
  const { speed, actor, problem } = event.data;
  const what = `Simulated time at ${str(speed)}×${after(", ordered by ", actor)}`;
  return str(problem) === ""
    ? { text: `${what}.`, tone: "warn" }
    : { text: `${what}, was refused: ${ended(str(problem))}`, tone: "danger" };
}

const SEVERITY_TONES: Readonly<Record<EventOf<"vehicle.status_text">["data"]["severity"], Tone>> = {
  emergency: "danger",
  alert: "danger",
  critical: "danger",
  error: "danger",
  warning: "warn",
  notice: "neutral",
  info: "neutral",
  debug: "neutral",
};

/** Commands keep their MAVLink name, which is what an engineer looks for. */
function command(name: EventOf<"run.command">["data"]["command"]): string {
  return name.toUpperCase();
}

function again(attempt: unknown): string {
  return typeof attempt === "number" && attempt > 1 ? ` (try ${attempt})` : "";
}

function after(before: string, value: unknown, behind = ""): string {
  const text = str(value);
  return text === "" ? "" : before + text + behind;
}

function ended(text: string): string {
  return /[.!?]$/.test(text) ? text : `${text}.`;
}

export function short(id: string | null): string {
  return id === null ? "?" : id.length > 12 ? `${id.slice(0, 8)}…` : id;
}

function took({ began_s, ended_s }: EventOf<"run.item_ended">["data"]): number | null {
  return began_s === null || ended_s === null ? null : ended_s - began_s;
}

function lowerFirst(text: string): string {
  return text.charAt(0).toLowerCase() + text.slice(1);
}

function lower(value: unknown): string {
  return str(value).replaceAll("_", " ").toLowerCase();
}

function str(value: unknown): string {
  return typeof value === "string" || typeof value === "number" ? String(value) : "";
}

// Events of jobs and of vehicles' queues as sentences. Pure.

type JobChange = EventOf<"job.changed">["data"]["change"];

const WORDS: Readonly<Record<Exclude<JobChange, "ended">, string>> = {
  queued: "waits",
  placed: "has another place",
  assigned: "is given to",
  requeued: "waits again",
  prepared: "is prepared on",
  start_asked: "is started on",
  started: "flies with",
  end_asked: "is taken off",
  noted: "waits on",
};
const WITH_VEHICLE: ReadonlySet<JobChange> = new Set([
  "assigned",
  "prepared",
  "start_asked",
  "started",
  "end_asked",
  "noted",
]);
const END_TONES: Partial<Record<JobState, Tone>> = { completed: "ok", failed: "danger", expired: "warn" };

export function sayJob(event: EventOf<"job.changed">): Sentence {
  const { change, job } = event.data;
  const what = change === "ended" ? `is ${job.state}` : WORDS[change];
  const vehicle = WITH_VEHICLE.has(change) ? ` ${event.vehicle_id ?? "its vehicle"}` : "";
  const tone = change === "ended" ? (END_TONES[job.state] ?? "neutral") : "info";
  return {
    text: `Job “${job.plan_name}” ${what}${vehicle}${job.reason === null ? "" : `: ${reasonWords(job.reason)}`}.`,
    tone,
  };
}

export function sayJobQueue({ data: { change, queue } }: EventOf<"job.queue_changed">, vehicle: string): Sentence {
  if (queue.stopped)
    return { text: `The job queue of ${vehicle} is stopped: ${reasonWords(queue.reason)}.`, tone: "danger" };
  return {
    text: `The job queue of ${vehicle} goes on${change === "resumed" && queue.actor !== "" ? `, says ${queue.actor}` : ""}.`,
    tone: "info",
  };
}
