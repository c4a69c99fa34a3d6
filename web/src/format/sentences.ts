/** Each event of the stream as a sentence that can be read aloud. Unknown kinds still say what they are. Pure. */

import type { ConsentRecord, DropRecord, EventKind, Run } from "../api/types";
import type { StreamEvent } from "../api/types";
import { sayJob, sayJobQueue } from "./job-sentences";
import { taskSummary, taskTitle, toldTask } from "../tasks/words";
import { distance, percent, seconds } from "./units";
import { asSentence, certaintyName, consentWords, plain, restsOnAckAlone, runReason, runStateName, runStateTone, type Tone } from "./words";

export interface Sentence {
  readonly text: string;
  readonly tone: Tone;
}

/** The name of a stored plan; null if it is not known. */
export type PlanName = (plan_id: string) => string | null;

type Say = (event: StreamEvent, vehicle: string, planName: PlanName) => Sentence;

const SAY: Readonly<Record<EventKind, Say>> = {
  "service.started": (e) => ({ text: `The service started${after(" (version ", e.data["version"], ")")}.`, tone: "neutral" }),
  "service.stopped": () => ({ text: "The service stopped.", tone: "warn" }),
  "vehicle.seen": (e, v) => ({ text: `${v} was seen${after(": ", lower(e.data["vehicle_type"]))}${after(", firmware ", e.data["firmware"])}.`, tone: "info" }),
  "vehicle.link_lost": (_, v) => ({ text: `The link to ${v} is lost.`, tone: "danger" }),
  "vehicle.link_restored": (_, v) => ({ text: `The link to ${v} is back.`, tone: "ok" }),
  "vehicle.changed": sayChanged,
  "vehicle.parameters": (e, v) => ({ text: `Parameters of ${v} were changed: ${settings(e.data["parameters"])}.`, tone: "warn" }),
  "vehicle.rebooted": (_, v) => ({ text: `${v} rebooted.`, tone: "danger" }),
  "vehicle.status_text": (e, v) => ({ text: `${v} says: “${str(e.data["text"])}”`, tone: severityTone(str(e.data["severity"])) }),
  "vehicle.quarantined": (e, v) => ({ text: `${v} is quarantined: ${str(e.data["reason"])}`, tone: "danger" }),
  "vehicle.command": (e, v) => ({ text: `${v} was told to ${lower(e.data["command"])}${after(" by ", e.data["by"])}${after(": ", lower(e.data["outcome"]))}.`, tone: "info" }),
  "offboard.lease": sayLease,
  "offboard.changed": sayOffboard,
  "tasks.changed": sayTasks,
  "tasks.gripper": (e, v) => ({ text: `${v}, task ${str(e.data["task_id"])}, ${lower(e.data["action"])}: ${lower(e.data["result"])}.`, tone: e.data["result"] === "sent" || e.data["result"] === "ACCEPTED" ? "drop" : "danger" }),
  "plan.created": (e) => ({ text: `Plan “${str(e.data["name"])}” was stored.`, tone: "neutral" }),
  "run.created": (e, v, name) => ({ text: `${runWords(e, name)} was created for ${v}.`, tone: "neutral" }),
  "run.changed": sayRun,
  "run.upload_progress": sayUpload,
  "run.mission_changed": (e, v) => ({ text: `${v} flies on with a changed plan, from “${str(part(e.data["change"], "continue_at"))}”${after(", ordered by ", part(e.data["change"], "by"))}.`, tone: "info" }),
  "run.continued": (e, v, name) => ({ text: `What was left of ${lowerFirst(runWords(e, name))} of ${v} is flown by run ${short(str(e.data["continued_by"]))}.`, tone: "info" }),
  "run.target_moved": (e, v) => ({ text: `${v} follows a moving target: “${str(e.data["waypoint_id"])}” is now ${distance(num(e.data["from_planned_m"]))} from where it was planned.`, tone: "info" }),
  "run.target_not_followed": (e, v) => ({ text: `${v} does not follow its moving target: ${str(e.data["reason"])}.`, tone: "warn" }),
  "run.plan_refused": (e, v, name) => ({ text: `${runWords(e, name)} was not started: ${v}, as it is set now, would not fly its plan.`, tone: "danger" }),
  "run.item": (e, v) => ({ text: `${v} ${e.data["what"] === "reached" ? "has done" : "is on its way to"} “${str(e.data["item_id"])}”.`, tone: "info" }),
  "run.predicted": (e, v) => ({ text: `Predicted for ${v}: ${seconds(num(e.data["duration_s"]))} in flight.`, tone: "neutral" }),
  "run.item_ended": (e, v) => ({ text: `“${str(e.data["item_id"])}” took ${v} ${seconds(took(e.data["began_s"], e.data["ended_s"]))}.`, tone: "neutral" }),
  "run.command": (e, v) => ({ text: `Sent ${command(e.data["command"])} to ${v}${again(e.data["attempt"])}.`, tone: "drop" }),
  "run.ack": (e, v) => ({ text: `${v} answered ${command(e.data["command"])}: ${lower(e.data["result"])}${e.data["progress"] ? ` (${percent(Number(e.data["progress"]))})` : ""}.`, tone: ackTone(str(e.data["result"])) }),
  "run.drop": sayDrop,
  "drop.consent_asked": (e, v) => ({ text: `${v} holds at “${str(e.data["plan_item_id"])}” and waits for an operator's consent.`, tone: "warn" }),
  "drop.consent_closed": sayConsent,
  "run.attachment": (e) => ({ text: `“${str(e.data["name"])}” was attached to “${str(e.data["plan_item_id"])}”${after(" by ", e.data["by"])}.`, tone: "info" }),
  "webhook.changed": (e) => ({ text: `A webhook to ${str(e.data["host"])} was ${lower(e.data["change"])}${after(" by ", e.data["by"])}.`, tone: e.data["change"] === "disabled" ? "warn" : "neutral" }),
  "job.changed": sayJob,
  "job.queue_changed": sayJobQueue,
  "simulator.fault": sayFault,
  "simulator.speed": saySpeed,
  "page.missing": (e) => ({ text: `Events ${str(e.data["first"])} to ${str(e.data["last"])} are no longer kept by the service.`, tone: "warn" }),
};

/** Runs are named by their plans, where these are known, else by their ids. */
export function sentence(event: StreamEvent, planName: PlanName = () => null): Sentence {
  const vehicle = event.vehicle_id ?? "A vehicle";
  const say: Say | undefined = SAY[event.kind]; // a newer service may tell more than this page knows
  return say?.(event, vehicle, planName) ?? { text: `${plain(event.kind.replaceAll(".", " "))}.`, tone: "neutral" };
}

function settings(parameters: unknown): string {
  return Object.entries((parameters ?? {}) as Record<string, unknown>).map(([name, value]) => `${name} ${str(value)}`).join(", ");
}

const LEASE_WORDS: Readonly<Record<string, string>> = { taken: "has the offboard lease of", handed_over: "took over the offboard lease of", overridden: "overrode the offboard lease of", offered: "offers the offboard lease of", released: "gave back the offboard lease of", expired: "let the offboard lease expire of", revoked: "lost the offboard lease of" };

function sayLease(event: StreamEvent, vehicle: string): Sentence {
  const change = str(event.data["change"]);
  const words = LEASE_WORDS[change] ?? "changed the offboard lease of";
  const tone = change === "revoked" || change === "expired" ? "warn" : "info";
  return { text: `${str(event.data["holder"])} ${words} ${vehicle}${after(": ", event.data["reason"])}.`, tone };
}

function sayOffboard(event: StreamEvent, vehicle: string): Sentence {
  const state = str(event.data["state"]);
  return { text: `${vehicle}, offboard control: ${state}${after(", ", event.data["reason"])}.`, tone: state === "active" ? "warn" : "neutral" };
}

const TASK_WORDS: Readonly<Record<string, string>> = { reached: "has come to its end", time_over: "has lasted its time", gripper_done: "has worked the gripper", skipped: "was skipped", moved: "has another place in the queue", removed: "was taken out", paused: "is paused", resumed: "goes on", by_hand: "waits: its pilot flies by hand", blocked: "is stopped", dropped: "and what came after it are dropped" };

/** By the insert mode of the request, which the event has as its reason. */
const QUEUED: Readonly<Record<string, string>> = { append: " at the end of the queue", prepend: " before the current one", replace_current: " in place of the current one", replace_all: " in place of all others" };

function sayTasks(event: StreamEvent, vehicle: string): Sentence {
  const change = str(event.data["change"]);
  const id = event.data["task_id"];
  const tone = change === "blocked" || change === "dropped" ? "warn" : "info";
  const task = change === "changed" ? toldTask(event.data["task"]) : null;
  if (task !== null) return { text: `${vehicle}: task ${str(id)} was changed to: ${taskTitle(task)}, ${taskSummary(task)}.`, tone };
  if (change === "inserted" && typeof id === "string") return { text: `${vehicle}: task ${id} is queued${QUEUED[str(event.data["reason"])] ?? ""}.`, tone };
  const what = typeof id === "string" ? `task ${id} ${TASK_WORDS[change] ?? "changed"}` : `the task queue ${change === "cleared" || change === "dropped" ? `was ${change}` : "changed"}`;
  return { text: `${vehicle}: ${what}${after(": ", event.data["reason"])}.`, tone };
}

function sayChanged(event: StreamEvent, vehicle: string): Sentence {
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
const PLANNED_ENDS: ReadonlySet<string> = new Set(["the mission is done", "on the ground"]);

/** Of a paused run: somebody wishes it, and the vehicle does not fly on yet. */
const RESUMING = "resuming, as asked";

/** Of an event with the whole run. */
function runWords({ run_id, data }: StreamEvent, planName: PlanName): string {
  const name = planName(str(data["plan_id"]));
  return name === null ? `Run ${short(run_id)}` : `“${name}”`;
}

function sayRun(event: StreamEvent, _: string, planName: PlanName): Sentence {
  const run = event.data as unknown as Run;
  if (typeof run.state !== "string") return { text: `Run ${short(event.run_id)} changed.`, tone: "neutral" };
  const of = `${runWords(event, planName)} of ${run.vehicle_id}`;
  if (run.state === "paused" && run.reason === RESUMING) return { text: `${of} is told to go on.`, tone: "info" };
  const reason = run.reason ? ` ${ended(asSentence(runReason(run.reason)))}` : "";
  return { text: `${of}: ${runStateName(run.state).toLowerCase()}.${reason}`, tone: run.state === "returning" && PLANNED_ENDS.has(run.reason) ? "info" : runStateTone(run.state) };
}

function sayUpload(event: StreamEvent, vehicle: string): Sentence {
  const { mission_type: list, sent, total, percent: done } = event.data;
  const what = `Uploading the ${lower(list) || "mission"} to ${vehicle}`;
  if (typeof sent === "number" && typeof total === "number") return { text: `${what}: ${sent} of ${total}.`, tone: "info" };
  return { text: `${what}${typeof done === "number" ? `: ${percent(done)}` : ""}.`, tone: "info" };
}

function sayDrop(event: StreamEvent, vehicle: string): Sentence {
  const drop = event.data as unknown as DropRecord;
  const reason = drop.reason ? ` ${ended(asSentence(drop.reason))}` : "";
  const item = drop.plan_item_id;
  switch (drop.outcome) {
    case "released":
      if (restsOnAckAlone(drop)) return { text: `${vehicle} acknowledged the release of “${item}”; no output was seen to move.`, tone: "warn" };
      return { text: `${vehicle} released “${item}”${after(", ", certaintyName(drop.certainty))}.${reason}`, tone: "ok" };
    case "kept":
      return { text: `${vehicle} kept “${item}” on board.${reason}`, tone: "warn" };
    case "unknown":
      return { text: `Whether ${vehicle} released “${item}” is not known.${reason}`, tone: "danger" };
    default:
      if (drop.output_evidence === "not_assigned") return { text: `Drop “${item}”: ${lower(drop.phase)}. No output is assigned to the gripper.`, tone: "warn" };
      return { text: `Drop “${item}”: ${lower(drop.phase)}.`, tone: "drop" };
  }
}

function sayConsent(event: StreamEvent): Sentence {
  const { plan_item_id: item, state, by, reason } = event.data;
  const words = consentWords({ state: str(state) as ConsentRecord["state"], answered_by: str(by) || null, reason: str(reason) });
  return { text: `“${str(item)}”: ${ended(words)}`, tone: state === "granted" ? "ok" : "warn" };
}

function sayFault(event: StreamEvent, vehicle: string): Sentence {
  const { fault, value, by, problem } = event.data;
  const what = `Simulated fault ${str(fault)} = ${JSON.stringify(value ?? null)} for ${vehicle}${after(" by ", by)}`;
  const why = str(problem);
  return why === "" ? { text: `${what}.`, tone: "warn" } : { text: `${what} was not set: ${ended(why)}`, tone: "danger" };
}

function saySpeed(event: StreamEvent): Sentence {
  const { speed, by, problem } = event.data;
  const what = `Simulated time at ${str(speed)}×${after(", ordered by ", by)}`;
  return str(problem) === "" ? { text: `${what}.`, tone: "warn" } : { text: `${what}, was refused: ${ended(str(problem))}`, tone: "danger" };
}

function severityTone(severity: string): Tone {
  if (/emergency|alert|critical|error/i.test(severity)) return "danger";
  return /warning/i.test(severity) ? "warn" : "neutral";
}

function ackTone(result: string): Tone {
  if (/accepted/i.test(result)) return "ok";
  return /progress/i.test(result) ? "info" : "danger";
}

/** Commands keep their MAVLink name, which is what an engineer looks for. */
function command(value: unknown): string {
  return str(value).replace(/^MAV_CMD_/, "").toUpperCase();
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

function num(value: unknown): number | null {
  return typeof value === "number" ? value : null;
}

function took(began_s: unknown, ended_s: unknown): number | null {
  const [began, ended] = [num(began_s), num(ended_s)];
  return began === null || ended === null ? null : ended - began;
}

function lowerFirst(text: string): string {
  return text.charAt(0).toLowerCase() + text.slice(1);
}

function lower(value: unknown): string {
  return str(value).replaceAll("_", " ").toLowerCase();
}

/** A field of an object in an event's data. */
function part(value: unknown, name: string): unknown {
  return typeof value === "object" && value !== null ? Reflect.get(value, name) : undefined;
}

function str(value: unknown): string {
  return typeof value === "string" || typeof value === "number" ? String(value) : "";
}
