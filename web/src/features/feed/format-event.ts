/** Each event of the stream as a sentence. A kind that lacks its sentence fails the type check. Pure. */

import type {
  EventKind,
  EventOf,
  InsertMode,
  JobState,
  ReasonCode,
  Run,
  StreamEvent,
  TaskChange,
} from "../../api/types";
import {
  certaintyLabel,
  dropLabel,
  flightModeLabel,
  formatConsent,
  isAcknowledgedOnly,
  landedLabel,
  runStateLabel,
  runStateTone,
  type Tone,
  vehicleTypeNoun,
} from "../../format/labels";
import { resultLabel, resultTone, severityTone } from "../../format/mavlink";
import { formatReason } from "../../format/reasons";
import { closed, humanize, shortId, shortName, toSentences } from "../../format/text";
import { formatDistance, formatDuration, formatPercent } from "../../format/units";
import { readEventTask, taskSummary, taskTitle } from "../tasks/labels";

export interface EventText {
  readonly text: string;
  readonly tone: Tone;
}

/** The name of a stored plan; null if it is unknown. */
export type PlanNames = (plan_id: string) => string | null;

type Formatter<K extends EventKind> = (event: EventOf<K>, vehicle: string, planNames: PlanNames) => EventText;

const FORMATTERS: { readonly [K in EventKind]: Formatter<K> } = {
  "service.started": ({ data }) => neutral(`Waydrop started${after(" (version ", data.release, ")")}.`),
  "service.stopped": () => warn("Waydrop stopped."),
  "request.accepted": ({ data }) => neutral(`${humanize(data.action)}, requested by ${data.actor}.`),
  "service.loop_stalled": ({ data }) => warn(`Waydrop was blocked for ${formatDuration(data.delay_s)}.`),
  "service.site_lease": ({ data }) =>
    data.taken_by === null
      ? ok(`This gateway has the site ${data.site} again.`)
      : danger(
          data.has_expired
            ? `Gateway ${data.taken_by}, which had the site ${data.site}, is not heard. If it is switched off, let this gateway take over: waydrop take-over.`
            : `Another gateway (${data.taken_by}) has the site ${data.site}: no run can begin here.`,
        ),
  "journal.pruned": ({ data }) =>
    neutral(
      data.before === null
        ? "Attached files were deleted at the end of their retention period."
        : `Events up to ${data.up_to} were deleted at the end of their retention period.`,
    ),
  "vehicle.seen": ({ data }, v) => info(`${v} connected: ${typeAndFirmware(data)}.`),
  "vehicle.link_lost": (_, v) => danger(`${v}: link lost.`),
  "vehicle.link_restored": (_, v) => ok(`${v}: link restored.`),
  "vehicle.changed": formatVehicleChange,
  "vehicle.parameters": ({ data }, v) => warn(`${v}: parameters changed: ${formatParameters(data.parameters)}.`),
  "vehicle.rebooted": (_, v) => danger(`${v} rebooted.`),
  "vehicle.status_text": ({ data }, v) => ({
    text: `${v}: “${data.text}”${formatRepetitions(data)}`,
    tone: severityTone(data.severity),
  }),
  "vehicle.quarantined": ({ data }, v) => danger(`${v} was quarantined: ${formatReason(data.reason)}.`),
  "vehicle.quarantine_ended": ({ data: { actor } }, v) =>
    actor ? warn(`${actor} ended the quarantine of ${v}.`) : ok(`The quarantine of ${v} has ended.`),
  "vehicle.commanded_in_quarantine": ({ data }, v) =>
    danger(`${flightModeLabel(data.mode)} was sent to ${v} although it is quarantined.`),
  "vehicle.link_security": ({ data: { security } }, v) => ({
    text: `The link to ${v} is ${security}.`,
    tone: security === "open" ? "warn" : "info",
  }),
  "vehicle.link_key": formatLinkKey,
  "link.refused": formatLinkRefused,
  "vehicle.command": formatVehicleCommand,
  "offboard.lease": formatLeaseChange,
  "offboard.changed": formatOffboardChange,
  "task.changed": formatTaskChange,
  "task.gripper": formatTaskGripper,
  "plan.created": ({ data }) => neutral(`Plan “${shortName(data.name)}” was stored.`),
  "run.created": ({ data }, v, names) => neutral(`${runName(data, names)} was created for ${v}.`),
  "run.changed": formatRunChange,
  "run.upload_progress": ({ data }, v) =>
    info(`${v}: uploading the ${data.mission_type}: ${data.sent} of ${data.total}.`),
  "run.mission_changed": ({ data: { change } }, v) =>
    info(`${v} continues at “${change.continue_at}” with a changed plan${after(", as ", change.actor, " asked")}.`),
  "run.continued": ({ data }, v, names) =>
    info(`${v}: run ${shortId(data.continued_by)} flies the rest of ${runName(data, names, "run")}.`),
  "run.taken_over": ({ data }, v, names) =>
    warn(
      `${v}: gateway ${data.taken_over?.gateway} goes on with ${runName(data, names, "run")} of ${data.taken_over?.from_gateway}.`,
    ),
  "run.target_moved": ({ data }, v) =>
    info(`${v} follows its target: “${data.waypoint_id}” moved ${formatDistance(data.from_planned_m)} off the plan.`),
  "run.target_not_followed": ({ data }, v) =>
    warn(`${v} does not follow its moving target: ${formatReason(data.reason)}.`),
  "run.plan_refused": ({ run_id }, v) =>
    danger(`Run ${shortId(run_id)} did not start: ${v} would not fly its plan with its present settings.`),
  "run.item": ({ data }, v) =>
    info(data.phase === "reached" ? `${v} completed “${data.item_id}”.` : `${v} is flying to “${data.item_id}”.`),
  "run.predicted": ({ data }, v) => neutral(`${v}: the flight should take ${formatDuration(data.duration_s)}.`),
  "run.item_ended": ({ data }, v) => neutral(`${v}: “${data.item_id}” took ${formatDuration(durationOf(data))}.`),
  "run.command": ({ data }, v) => ({
    text: `Sent ${data.command.toUpperCase()} to ${v}${tryNumber(data.attempt)}.`,
    tone: data.command === "DO_GRIPPER" || data.command === "DO_WINCH" ? "drop" : "info",
  }),
  "run.ack": formatAck,
  "run.drop": formatDrop,
  "drop.consent_asked": ({ data }, v) => warn(`${v} holds at “${data.plan_item_id}” and waits for consent.`),
  "drop.consent_closed": formatConsentClosed,
  "run.attachment": ({ data }) =>
    info(`“${data.name}” was attached to “${data.plan_item_id}”${after(" by ", data.actor)}.`),
  "webhook.changed": ({ data: { host, change, actor } }) => ({
    text: `The webhook to ${host} was ${change}${after(" by ", actor)}.`,
    tone: change === "disabled" ? "warn" : "neutral",
  }),
  "job.changed": formatJobChange,
  "job.queue_changed": formatJobQueueChange,
  "simulator.fault": formatSimulatedFault,
  "simulator.speed": formatSimulatorSpeed,
  "page.missing": ({ data }) => warn(`The service no longer has the events ${data.first} to ${data.last}.`),
};

/** The name of the plan that an event's sentence names; null: none, or unknown. */
export function planNameIn(event: StreamEvent, planNames: PlanNames): string | null {
  switch (event.kind) {
    case "run.created":
    case "run.changed":
    case "run.continued":
    case "run.taken_over":
      return planNames(event.data.plan_id);
    case "plan.created":
      return event.data.name;
    case "job.changed":
      return event.data.job.plan_name;
    default:
      return null;
  }
}

/** Names runs by their plans where these are known, else by their ids. */
export function formatEvent(event: StreamEvent, planNames: PlanNames = () => null): EventText {
  const format = FORMATTERS[event.kind] as Formatter<EventKind> | undefined; // a newer service may send more kinds
  const vehicle = event.vehicle_id ?? "A vehicle";
  return format?.(event as never, vehicle, planNames) ?? neutral(`${humanize(event.kind.replaceAll(".", " "))}.`);
}

function typeAndFirmware({ vehicle_type, firmware }: EventOf<"vehicle.seen">["data"]): string {
  return `${vehicle_type === null ? "unknown type" : vehicleTypeNoun(vehicle_type)}${after(", firmware ", firmware)}`;
}

function formatRepetitions({ repeated, last_age_s: age }: EventOf<"vehicle.status_text">["data"]): string {
  if (!repeated) {
    return "";
  }
  return age == null
    ? ` (repeated ${repeated} times)`
    : ` (repeated ${repeated} times, last ${formatDuration(age)} ago)`;
}

function formatParameters(parameters: Readonly<Record<string, number>>): string {
  return Object.entries(parameters)
    .map(([name, value]) => `${name} ${value}`)
    .join(", ");
}

function formatVehicleChange({ data }: EventOf<"vehicle.changed">, vehicle: string): EventText {
  const { mode, armed, landed } = data;
  if (data.in_failsafe) return danger(`${vehicle} is in failsafe${after(", mode ", mode && flightModeLabel(mode))}.`);
  const parts = [
    mode === null ? "" : `${flightModeLabel(mode)} mode`,
    armed === null ? "" : armed ? "armed" : "disarmed",
    landed === "undefined" ? "" : landedLabel(landed).toLowerCase(),
  ].filter((part) => part !== "");
  return neutral(`${vehicle}: ${parts.join(", ") || "changed"}.`);
}

const COMMAND_OUTCOMES: Readonly<Record<EventOf<"vehicle.command">["data"]["outcome"], string>> = {
  sent: "sent",
  done: "done",
  failed: "failed",
};

function formatVehicleCommand({ data }: EventOf<"vehicle.command">, vehicle: string): EventText {
  const { command, actor, outcome, reason } = data;
  const text = `${actor} commanded ${vehicle} to ${command}: ${COMMAND_OUTCOMES[outcome]}${because(reason)}.`;
  return outcome === "failed" ? danger(text) : info(text);
}

function formatLinkKey({ data }: EventOf<"vehicle.link_key">, vehicle: string): EventText {
  const { outcome, actor, fingerprint, reason } = data;
  if (outcome === "done") return info(`${vehicle} signs with a new key${after(" (", fingerprint)}), set by ${actor}.`);
  if (outcome === "failed") return warn(`${vehicle} did not accept its new key${because(reason)}.`);
  return info(`${actor} sent ${vehicle} a new signing key.`);
}

const FRAME_REFUSALS: Readonly<Record<EventOf<"link.refused">["data"]["refusal"], string>> = {
  peer_not_allowed: "from an address that is not allowed",
  other_peer: "for a vehicle that uses another address",
  system_not_allowed: "from a system ID that is not allowed",
  too_many_systems: "from more system IDs than the connection allows",
  unsigned: "without a signature",
  bad_signature: "signed with an unknown key",
  old_timestamp: "with a signature timestamp older than a previous one",
  other_link_id: "signed on another link of the vehicle",
  too_fast: "above the rate limit of a vehicle",
  texts: "because of too many status texts",
  late: "that arrived while the service was blocked",
  congested: "because the link to the vehicle is full",
  not_announced: "before a heartbeat",
  ground_station: "from another ground station",
  damaged: "that were damaged",
};

function formatLinkRefused({ data }: EventOf<"link.refused">): EventText {
  const { refusal, count, connections, peer, systems } = data;
  const claimed = systems.length > 0 ? `, system ${systems.join(", ")}` : "";
  const why = FRAME_REFUSALS[refusal] ?? humanize(refusal); // a newer service may know more reasons
  const frames = count === 1 ? "1 frame" : `${count} frames`;
  return warn(`Rejected ${frames} on ${connections.join(", ")} ${why} (last from ${peer}${claimed}).`);
}

type LeaseData = EventOf<"offboard.lease">["data"];

const LEASE_CHANGES: Readonly<Record<LeaseData["change"], (vehicle: string, data: LeaseData) => string>> = {
  acquired: (v, { holder }) => `${holder} took the lease of ${v}`,
  handed_over: (v, { holder, other }) => `${holder} took over the lease of ${v}${after(" from ", other)}`,
  overridden: (v, { holder, other }) => `${holder} overrode ${other === null ? "the" : `${other}'s`} lease of ${v}`,
  offered: (v, { holder, other }) =>
    other === null ? `${holder} withdrew the offer of ${v}'s lease` : `${holder} offered ${other} the lease of ${v}`,
  released: (v, { holder }) => `${holder} released the lease of ${v}`,
  expired: (v, { holder }) => `${holder}'s lease of ${v} expired`,
  revoked: (v, { holder }) => `${holder} lost the lease of ${v}`,
};

function formatLeaseChange({ data }: EventOf<"offboard.lease">, vehicle: string): EventText {
  const change = LEASE_CHANGES[data.change]?.(vehicle, data) ?? `The lease of ${vehicle} changed`;
  const text = `${change}${because(data.reason)}.`;
  return data.change === "revoked" || data.change === "expired" ? warn(text) : info(text);
}

const OFFBOARD_STATES: Readonly<Record<EventOf<"offboard.changed">["data"]["state"], string>> = {
  idle: "off",
  leased: "leased",
  checking: "checking",
  holding: "commanding Hold",
  streaming: "streaming setpoints",
  switching: "switching the mode",
  active: "on",
  leaving: "leaving",
};

function formatOffboardChange({ data: { state, reason } }: EventOf<"offboard.changed">, vehicle: string): EventText {
  const text = `${vehicle}: manual control ${OFFBOARD_STATES[state] ?? state}${because(reason)}.`;
  return state === "active" ? warn(text) : neutral(text);
}

const TASK_CHANGES: Readonly<Record<TaskChange, string>> = {
  inserted: "was queued",
  changed: "was changed",
  moved: "was moved in the queue",
  removed: "was removed",
  reached: "is complete",
  time_over: "ended: its time is up",
  gripper_done: "operated the gripper",
  skipped: "was skipped",
  cleared: "was cleared",
  paused: "paused",
  resumed: "resumed",
  manual: "waits: the pilot has manual control",
  blocked: "stopped",
  dropped: "was discarded",
};

const INSERT_MODES: Readonly<Record<InsertMode, string>> = {
  append: " at the end",
  prepend: " before the current task",
  replace_current: " instead of the current task",
  replace_all: " instead of all others",
};

function formatTaskChange({ data }: EventOf<"task.changed">, vehicle: string): EventText {
  const { change, task_id: id, insert_mode: mode, reason } = data;
  const format = change === "blocked" || change === "dropped" ? warn : info;
  const what = id === null ? "the task queue" : `task ${id}`;
  const task = change === "changed" ? readEventTask(data.task) : null;
  if (task !== null) return format(`${vehicle}: ${what} is now: ${taskTitle(task)}, ${taskSummary(task)}.`);
  const where = change === "inserted" && mode ? (INSERT_MODES[mode] ?? "") : "";
  if (change === "dropped" && id !== null)
    return warn(`${vehicle}: the tasks from ${id} on were discarded${because(reason)}.`);
  return format(`${vehicle}: ${what} ${TASK_CHANGES[change] ?? "changed"}${where}${because(reason)}.`);
}

const GRIPPER_OUTCOMES: Readonly<Record<EventOf<"task.gripper">["data"]["outcome"], readonly [string, Tone]>> = {
  sent: ["sent", "drop"],
  done: ["done", "drop"],
  failed: ["failed", "danger"],
  unknown: ["unknown", "danger"],
};

function formatTaskGripper({ data }: EventOf<"task.gripper">, vehicle: string): EventText {
  const [outcome, tone] = GRIPPER_OUTCOMES[data.outcome] ?? [humanize(data.outcome), "warn"];
  return { text: `${vehicle}: task ${data.task_id}, ${data.action}: ${outcome}${because(data.reason)}.`, tone };
}

/** A flight should end with a return for one of these reasons. */
const PLANNED_RETURNS: ReadonlySet<ReasonCode> = new Set<ReasonCode>(["run.mission_done", "run.on_ground"]);

export function isPlannedReturn({ state, reason }: Run): boolean {
  return state === "returning" && reason !== null && PLANNED_RETURNS.has(reason.code);
}

/** Of an event with the whole run. */
export function runName({ id, plan_id }: Run, planNames: PlanNames, noun = "Run"): string {
  const name = planNames(plan_id);
  return name === null ? `${noun} ${shortId(id)}` : `“${shortName(name)}”`;
}

function formatRunChange({ data: run }: EventOf<"run.changed">, _: string, planNames: PlanNames): EventText {
  const name = `${runName(run, planNames)} on ${run.vehicle_id}`;
  if (run.state === "paused" && run.reason?.code === "run.resuming_as_asked") return info(`${name} resumes.`);
  const [state, why] = [runStateLabel(run.state).toLowerCase(), formatReason(run.reason)];
  return {
    text: why.startsWith(state) ? `${name}: ${why}.` : `${name}: ${state}.${asSentence(run.reason)}`,
    tone: isPlannedReturn(run) ? "info" : runStateTone(run.state),
  };
}

const ACK_OUTCOMES: Readonly<
  Record<Exclude<EventOf<"run.ack">["data"]["outcome"], "acknowledged">, readonly [string, Tone]>
> = {
  done: ["done", "ok"],
  failed: ["failed", "danger"],
  not_sent: ["not sent", "danger"],
  unknown: ["outcome unknown", "danger"],
};

/** What the vehicle answered, or what became of a command that has no answer of its own. */
function formatAck({ data }: EventOf<"run.ack">, vehicle: string): EventText {
  const command = data.command.toUpperCase();
  if (data.outcome !== "acknowledged") {
    const [outcome, tone] = ACK_OUTCOMES[data.outcome] ?? [humanize(data.outcome), "warn"];
    return { text: `${vehicle}: ${command}: ${outcome}${after(": ", data.detail)}.`, tone };
  }
  const progress = data.progress ? ` (${formatPercent(data.progress)})` : "";
  return {
    text: `${vehicle} answered ${command}: ${resultLabel(data.result, data.result_code)}${progress}.`,
    tone: resultTone(data.result),
  };
}

function formatDrop({ data: drop }: EventOf<"run.drop">, vehicle: string): EventText {
  const item = `“${drop.plan_item_id}”`;
  const reason = asSentence(drop.reason);
  switch (drop.outcome) {
    case "released":
      if (isAcknowledgedOnly(drop)) {
        return warn(`${vehicle} acknowledged the release of ${item}; no output was observed to move.`);
      }
      return ok(`${vehicle} released ${item}${because(drop.reason) || after(", ", certaintyLabel(drop.certainty))}.`);
    case "kept":
      return warn(`${vehicle} kept ${item} on board.${reason}`);
    case "unknown":
      return danger(`It is unknown whether ${vehicle} released ${item}.${reason}`);
    case "pending": {
      const text = `${vehicle}: drop ${item}: ${dropLabel(drop).toLowerCase()}.`;
      if (drop.output_evidence === "not_assigned") return warn(`${text} No output is assigned to the gripper.`);
      return { text, tone: "drop" };
    }
  }
}

function formatConsentClosed({ data }: EventOf<"drop.consent_closed">): EventText {
  const { plan_item_id: item, state, actor, comment, reason } = data;
  const text = `“${item}”: ${closed(formatConsent({ state, answered_by: actor, comment, reason }))}`;
  return state === "granted" ? ok(text) : warn(text);
}

type JobChange = EventOf<"job.changed">["data"]["change"];

/** What became of a job; with its vehicle, where it has one. */
const JOB_CHANGES: Readonly<Record<JobChange, (vehicle: string) => string>> = {
  queued: () => "is queued",
  placed: () => "was moved in the queue",
  assigned: (v) => `was assigned to ${v}`,
  requeued: () => "is queued again",
  taken: (v) => `was taken by the gateway of ${v}`,
  returned: (v) => `was given back by the gateway of ${v}`,
  prepared: (v) => `is ready on ${v}`,
  start_asked: (v) => `is starting on ${v}`,
  started: (v) => `is flying with ${v}`,
  end_requested: (v) => `is being removed from ${v}`,
  noted: (v) => `waits on ${v}`,
  ended: () => "ended",
};

const JOB_ENDS: Readonly<Partial<Record<JobState, Tone>>> = { completed: "ok", failed: "danger", expired: "warn" };

function formatJobChange({ data: { change, job }, vehicle_id }: EventOf<"job.changed">): EventText {
  const what = change === "ended" ? job.state : (JOB_CHANGES[change]?.(vehicle_id ?? "its vehicle") ?? "changed");
  const tone = change === "ended" ? (JOB_ENDS[job.state] ?? "neutral") : "info";
  return { text: `Job “${shortName(job.plan_name)}” ${what}${because(job.reason)}.`, tone };
}

function formatJobQueueChange({ data }: EventOf<"job.queue_changed">, vehicle: string): EventText {
  const { change, queue } = data;
  if (queue.stopped) return danger(`The job queue of ${vehicle} stopped${because(queue.reason)}.`);
  return info(
    `The job queue of ${vehicle} resumed${change === "resumed" ? after(", as ", queue.actor, " asked") : ""}.`,
  );
}

function formatSimulatedFault({ data }: EventOf<"simulator.fault">, vehicle: string): EventText {
  const { fault, value, actor, problem } = data;
  const what = `${actor} set the simulated fault ${fault} = ${JSON.stringify(value ?? null)} for ${vehicle}`;
  return problem ? danger(`${what}, but it failed: ${closed(problem)}`) : warn(`${what}.`);
}

function formatSimulatorSpeed({ data: { speed, actor, problem } }: EventOf<"simulator.speed">): EventText {
  const what = `${actor} set the simulation speed to ${speed}×`;
  return problem ? danger(`${what}, but it failed: ${closed(problem)}`) : warn(`${what}.`);
}

export function durationOf({ began_s, ended_s }: EventOf<"run.item_ended">["data"]): number | null {
  return began_s === null || ended_s === null ? null : ended_s - began_s;
}

function tryNumber(attempt: number | null): string {
  return attempt !== null && attempt > 1 ? ` (try ${attempt})` : "";
}

type ReasonOf = Parameters<typeof formatReason>[0];

/** ": the link is lost". */
function because(reason: ReasonOf): string {
  return after(": ", formatReason(reason));
}

/** " The link is lost." */
function asSentence(reason: ReasonOf): string {
  return after(" ", toSentences(formatReason(reason)));
}

function after(before: string, value: string | null | undefined, behind = ""): string {
  return value ? before + value + behind : "";
}

const neutral = (text: string): EventText => ({ text, tone: "neutral" });
const info = (text: string): EventText => ({ text, tone: "info" });
const ok = (text: string): EventText => ({ text, tone: "ok" });
const warn = (text: string): EventText => ({ text, tone: "warn" });
const danger = (text: string): EventText => ({ text, tone: "danger" });
