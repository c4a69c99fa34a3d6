/**
 * Groups the events of the feed into groups: an upload, a start, an item, a drop, a vehicle's connection. A group has
 * one line, which grows while it happens. Pure.
 */

import type { EventKind, EventOf, StreamEvent } from "../../api/types";
import { severityTone } from "../../format/mavlink";
import { isSameReason } from "../../format/reasons";
import { hasRunEnded } from "../../store/runs";
import { isPlannedReturn } from "./format-event";

export interface EventGroup {
  /** Stays the same while the group grows. */
  readonly key: string;
  /** What all its events are about. */
  readonly topic: Topic;
  /** Newest first, never empty. */
  readonly events: readonly StreamEvent[];
  /** The event that its line tells. */
  readonly head: StreamEvent;
  /** Of an item: its type, from the prediction of the run; null if unknown. */
  readonly itemType: string | null;
  /** When the pause began that ended in it; null if none did. */
  readonly pausedAt: number | null;
}

export type Topic =
  | "upload"
  | "start"
  | "item"
  | "pause"
  | "return"
  | "change"
  | "end"
  | "link"
  | "stalls"
  | "refused"
  | "requests"
  | "other";

/** Topics of the service itself, which no operator of a vehicle has to read. */
const SERVICE_TOPICS: ReadonlySet<Topic> = new Set<Topic>(["stalls", "refused", "requests"]);

export function isServiceGroup({ topic }: EventGroup): boolean {
  return SERVICE_TOPICS.has(topic);
}

/** Events of one subject that are further apart than this are told apart, unless the subject says otherwise. */
const LULL_S = 60;
/** A plan that is stored so shortly before its run belongs to the upload. */
const STORED_FOR_S = 10;

/** The group that an event belongs to. */
interface Assignment {
  readonly topic: Topic;
  readonly subject: string;
  /** It starts a new group even if one of its subject is open. */
  readonly begins?: boolean;
  /** The group stays open however long nothing happens. */
  readonly lasts?: boolean;
  /** What else the run, or the vehicle without one, reports belongs to it from now on. */
  readonly step?: boolean;
  /** Nothing more belongs to it but what names it. */
  readonly ends?: boolean;
}

interface OpenGroup {
  readonly key: string;
  readonly topic: Topic;
  /** Oldest first. */
  readonly events: StreamEvent[];
  readonly itemType: string | null;
  pausedAt: number | null;
}

/** What a run, or a vehicle without one, is at. */
interface Step {
  readonly assignment: Assignment;
  readonly group: OpenGroup;
  /** The step that a command interrupted: it goes on if the command fails. */
  readonly before: Step | null;
}

/** `feed` has the newest event first, and so have the groups, by their first event. */
export function groupEvents(feed: readonly StreamEvent[]): readonly EventGroup[] {
  const grouping = new Grouping();
  for (const event of feed.toReversed()) grouping.add(event);
  return grouping.groups();
}

class Grouping {
  private readonly all: OpenGroup[] = [];
  private readonly bySubject = new Map<string, OpenGroup>();
  /** The current step of each run, and of each vehicle without one. */
  private readonly steps = new Map<string, Step>();
  /** Types of items as predicted, by run and item. */
  private readonly itemTypes = new Map<string, string>();
  /** The newest change of each run. */
  private readonly changes = new Map<string, EventOf<"run.changed">>();
  /** When the pause of a run began that is paused. */
  private readonly pauses = new Map<string, number>();

  add(event: StreamEvent): void {
    if (event.kind === "run.predicted")
      for (const { item_id, type } of event.data.entries) this.itemTypes.set(itemOf(event, item_id).subject, type);
    const of = event.run_id ?? event.vehicle_id ?? "";
    const current = this.steps.get(of) ?? null;
    const assignment = this.assign(event, of, current);
    const group = this.groupFor(assignment, event);
    if (assignment.step === true) this.steps.set(of, stepOf(assignment, group, current));
    if (assignment.ends === true) this.steps.delete(of);
    if (event.kind === "run.changed") this.followPause(event, of, group);
    if (isFailedCommand(event)) this.close(of, group);
  }

  groups(): readonly EventGroup[] {
    return this.all
      .map((group) => ({ ...group, head: headOf(group.events), events: group.events.toReversed() }))
      .reverse();
  }

  /** The open group that takes the event, or a new one. */
  private groupFor(assignment: Assignment, event: StreamEvent): OpenGroup {
    const open = this.bySubject.get(assignment.subject) ?? this.storedPlan(event);
    if (open === undefined || assignment.begins === true || !(assignment.lasts === true || isSoonAfter(open, event)))
      return this.open(assignment, event);
    open.events.push(event);
    this.bySubject.set(assignment.subject, open);
    return open;
  }

  private open({ topic, subject }: Assignment, event: StreamEvent): OpenGroup {
    const itemType = topic === "item" ? (this.itemTypes.get(subject) ?? null) : null;
    const group = { key: `${subject} ${event.position}`, topic, events: [event], itemType, pausedAt: null };
    this.all.push(group);
    this.bySubject.set(subject, group);
    return group;
  }

  /** The group of a plan that was stored for this run. */
  private storedPlan(event: StreamEvent): OpenGroup | undefined {
    if (event.kind !== "run.created") return undefined;
    const stored = this.bySubject.get(`plan ${event.data.plan_id}`);
    return stored !== undefined && event.time - (stored.events[0]?.time ?? 0) < STORED_FOR_S ? stored : undefined;
  }

  private assign(event: StreamEvent, of: string, current: Step | null): Assignment {
    const rule = ASSIGNMENTS[event.kind] as AssignmentRule<EventKind> | undefined; // a newer service may send others
    if (rule === undefined) return { topic: "other", subject: event.kind, begins: true };
    if (event.kind === "run.changed") {
      const known = this.changes.get(of);
      this.changes.set(of, event);
      // that a command is pending, or is no more: part of the command
      if (current !== null && known !== undefined && isSameState(known, event)) return current.assignment;
    }
    return rule(event as never, current?.assignment ?? null);
  }

  /** A pause lasts from the first "paused" until the run is anything else. */
  private followPause({ data, time }: EventOf<"run.changed">, of: string, group: OpenGroup): void {
    const since = this.pauses.get(of);
    if (data.state === "paused") this.pauses.set(of, since ?? time);
    else if (since !== undefined) {
      this.pauses.delete(of);
      if (group.topic !== "pause") return;
      group.pausedAt = since;
      this.goOn(of, beforePause(this.steps.get(of) ?? null));
    }
  }

  /** The step is over: what was before the command goes on. */
  private close(of: string, group: OpenGroup): void {
    const step = this.steps.get(of);
    if (step === undefined || step.group !== group || !INTERRUPTING.has(group.topic)) return;
    this.goOn(of, step.before);
  }

  private goOn(of: string, step: Step | null): void {
    if (step === null) {
      this.steps.delete(of);
      return;
    }
    this.steps.set(of, step);
    this.bySubject.set(step.assignment.subject, step.group);
  }
}

/** The step that was before a pause: a command to resume, which may be repeated, is of the pause too. */
function beforePause(step: Step | null): Step | null {
  return step !== null && step.assignment.topic === "pause" ? beforePause(step.before) : step;
}

/** Steps that a command begins while another one is under way. */
const INTERRUPTING: ReadonlySet<Topic> = new Set<Topic>(["pause", "return", "change"]);

function stepOf(assignment: Assignment, group: OpenGroup, current: Step | null): Step {
  const interrupted = INTERRUPTING.has(assignment.topic) ? current : null;
  const before = current?.group === group ? current.before : interrupted;
  return { assignment: { ...assignment, begins: false }, group, before };
}

function isSameState({ data: one }: EventOf<"run.changed">, { data: other }: EventOf<"run.changed">): boolean {
  return one.state === other.state && isSameReason(one.reason, other.reason);
}

const FAILURES: ReadonlySet<EventOf<"run.ack">["data"]["outcome"]> = new Set([
  "failed",
  "not_sent",
  "unknown",
] as const);

/** Of a command that a step began with. */
function isFailedCommand(event: StreamEvent): boolean {
  return event.kind === "run.ack" && COMMANDED[event.data.command] !== undefined && FAILURES.has(event.data.outcome);
}

function isSoonAfter(open: OpenGroup, event: StreamEvent): boolean {
  return event.time - (open.events.at(-1)?.time ?? 0) < LULL_S;
}

/** The newest of the events that say most. A change of a run that says the same again is no news. */
function headOf(events: readonly StreamEvent[]): StreamEvent {
  return events.reduce((head, event) => {
    if (head.kind === "run.changed" && event.kind === "run.changed" && isSameState(head, event)) return head;
    return weight(event) >= weight(head) ? event : head;
  });
}

const LEASE_ENDS: ReadonlySet<EventOf<"offboard.lease">["data"]["change"]> = new Set([
  "released",
  "expired",
  "revoked",
] as const);

function weight(event: StreamEvent): number {
  switch (event.kind) {
    case "run.drop":
      return event.data.outcome === "pending" ? 4 : 6;
    case "run.changed":
      return hasRunEnded(event.data) ? 5 : 2;
    case "run.plan_refused":
    case "run.mission_changed":
      return 5;
    case "drop.consent_asked":
    case "drop.consent_closed":
      return 4;
    case "run.ack":
      return isFailedCommand(event) ? 4 : 0;
    case "run.item":
      return 3;
    case "run.upload_progress":
      return 2;
    case "offboard.lease":
      return LEASE_ENDS.has(event.data.change) ? 2 : 1;
    case "run.created":
    case "plan.created":
    case "vehicle.seen":
    case "offboard.changed":
      return 1;
    default:
      return 0;
  }
}

type AssignmentRule<K extends EventKind> = (event: EventOf<K>, step: Assignment | null) => Assignment;

/** A kind that lacks its assignment fails the type check. */
const ASSIGNMENTS: { readonly [K in EventKind]: AssignmentRule<K> } = {
  "page.missing": () => ({ topic: "other", subject: "missing", begins: true }),
  "service.started": () => ({ topic: "other", subject: "service", begins: true }),
  "service.stopped": () => ({ topic: "other", subject: "service", begins: true }),
  "service.site_lease": () => brief("site"),
  "service.loop_stalled": () => lasting("stalls", "stalls"),
  "journal.pruned": () => brief("retention"),
  "link.refused": () => lasting("refused", "refused"),
  "request.accepted": () => lasting("requests", "requests"),
  "webhook.changed": ({ data }) => brief(`webhook ${data.webhook_id}`),
  "simulator.fault": ({ vehicle_id, data }) => brief(`fault ${vehicle_id} ${data.fault}`),
  "simulator.speed": () => brief("speed"),
  "plan.created": ({ data }) => ({ topic: "upload", subject: `plan ${data.plan_id}`, begins: true }),
  "job.changed": ({ data }) => lasting("other", `job ${data.job.id}`),
  "job.queue_changed": ({ vehicle_id }) => brief(`queue ${vehicle_id}`),

  "vehicle.seen": ({ vehicle_id }) => ({ ...brief(`seen ${vehicle_id}`), step: true }),
  "vehicle.link_lost": ({ vehicle_id }) => ({ ...lasting("link", `link ${vehicle_id}`), begins: true }),
  "vehicle.link_restored": ({ vehicle_id }) => lasting("link", `link ${vehicle_id}`),
  "vehicle.changed": (event, step) =>
    event.data.in_failsafe ? brief(`failsafe ${event.vehicle_id}`) : part(event, step),
  "vehicle.parameters": ({ vehicle_id }) => brief(`parameters ${vehicle_id}`),
  "vehicle.rebooted": ({ vehicle_id }) => ({ ...brief(`reboot ${vehicle_id}`), begins: true }),
  "vehicle.status_text": (event, step) =>
    severityTone(event.data.severity) === "neutral"
      ? part(event, step)
      : brief(`text ${event.vehicle_id} ${event.data.text}`),
  "vehicle.quarantined": ({ vehicle_id }) => brief(`quarantine ${vehicle_id}`),
  "vehicle.quarantine_ended": ({ vehicle_id }) => brief(`quarantine ${vehicle_id}`),
  "vehicle.commanded_in_quarantine": ({ vehicle_id, data }) => brief(`quarantine ${vehicle_id} ${data.mode}`),
  "vehicle.link_security": ({ vehicle_id }) => brief(`security ${vehicle_id}`),
  "vehicle.link_key": ({ vehicle_id }) => brief(`key ${vehicle_id}`),
  "vehicle.command": ({ vehicle_id, data }) => ({
    ...brief(`command ${vehicle_id} ${data.command}`),
    begins: data.outcome === "sent",
  }),
  "offboard.lease": ({ vehicle_id, data }) => ({
    ...lasting("other", `control ${vehicle_id}`),
    begins: data.change === "acquired",
    step: !LEASE_ENDS.has(data.change),
    ends: LEASE_ENDS.has(data.change),
  }),
  "offboard.changed": ({ vehicle_id }) => lasting("other", `control ${vehicle_id}`),
  "task.changed": ({ vehicle_id, data }) =>
    data.task_id === null || data.change === "dropped"
      ? lasting("other", `control ${vehicle_id}`)
      : { ...lasting("other", `task ${vehicle_id} ${data.task_id}`), begins: data.change === "inserted" },
  "task.gripper": ({ vehicle_id, data }) => lasting("other", `task ${vehicle_id} ${data.task_id}`),

  "run.created": ({ run_id }) => step("upload", run_id),
  "run.predicted": part,
  "run.upload_progress": (event, current) => current ?? step("upload", event.run_id),
  "run.plan_refused": (event, current) => current ?? step("start", event.run_id),
  "run.changed": assignRunChange,
  "run.command": ({ run_id, data: { command } }, current) => {
    const topic = COMMANDED[command];
    if (topic === undefined) return current ?? step("other", run_id);
    return { ...nextStep(topic, run_id, current), ...(ORDERS.has(command) ? { begins: true } : {}) };
  },
  "run.ack": (event, current) => {
    const topic = COMMANDED[event.data.command];
    return topic === undefined ? part(event, current) : lasting(topic, `${topic} ${event.run_id}`);
  },
  "run.item": (event, current) => {
    const { item_id, phase } = event.data;
    if (item_id === null) return part(event, current);
    const item = itemOf(event, item_id);
    return phase === "current" ? { ...item, step: true, begins: current?.subject !== item.subject } : item;
  },
  "run.item_ended": (event) => itemOf(event, event.data.item_id),
  "run.drop": (event) => ({ ...itemOf(event, event.data.plan_item_id), step: event.data.phase !== "done" }),
  "drop.consent_asked": (event) => itemOf(event, event.data.plan_item_id),
  "drop.consent_closed": (event) => itemOf(event, event.data.plan_item_id),
  "run.mission_changed": ({ run_id }, current) => nextStep("change", run_id, current),
  "run.taken_over": ({ run_id }) => ({ topic: "other", subject: `taken over ${run_id}`, begins: true }),
  "run.continued": ({ run_id }) => ({ topic: "other", subject: `continued ${run_id}`, begins: true }),
  "run.target_moved": ({ run_id, data }) => lasting("other", `target ${run_id} ${data.waypoint_id}`),
  "run.target_not_followed": ({ run_id, data }) => lasting("other", `target ${run_id} ${data.waypoint_id}`),
  "run.attachment": ({ run_id, data }) => lasting("other", `attachments ${run_id} ${data.plan_item_id}`),
};

/** The step that a command begins. The others belong to the step that the run is at. */
const COMMANDED: Readonly<Partial<Record<EventOf<"run.command">["data"]["command"], Topic>>> = {
  arm: "start",
  start_mission: "start",
  pause: "pause",
  resume: "pause",
  return: "return",
  land: "return",
  change_mission: "change",
};

/** Each of these is told in a line of its own, also if it repeats one that failed. */
const ORDERS: ReadonlySet<EventOf<"run.command">["data"]["command"]> = new Set([
  "pause",
  "resume",
  "return",
  "land",
] as const);

function assignRunChange({ run_id, data: run }: EventOf<"run.changed">, current: Assignment | null): Assignment {
  switch (run.state) {
    case "created":
    case "uploading":
    case "uploaded":
      return step("upload", run_id);
    case "starting":
      return step("start", run_id);
    case "flying":
    case "at_drop":
      return current ?? step("other", run_id);
    case "paused":
      return nextStep("pause", run_id, current);
    case "returning":
      // Its reason may follow; a return that somebody commanded has begun with the command.
      return run.reason === null || isPlannedReturn(run)
        ? (current ?? step("return", run_id))
        : nextStep("return", run_id, current);
    default: {
      const early = current?.topic === "upload" || current?.topic === "start";
      return early ? current : step("end", run_id);
    }
  }
}

function itemOf({ run_id }: StreamEvent, item_id: string): Assignment {
  return lasting("item", `item ${run_id} ${item_id}`);
}

/** What a vehicle reports belongs to the step it is at, else it stands with what it reports about the same time. */
function part({ run_id, vehicle_id }: StreamEvent, current: Assignment | null): Assignment {
  return current ?? (run_id === null ? brief(`vehicle ${vehicle_id}`) : step("other", run_id));
}

function step(topic: Topic, run_id: string | null): Assignment {
  return { ...lasting(topic, `${topic} ${run_id}`), step: true };
}

/** It may come several times in a run: a second pause is another group. */
function nextStep(topic: Topic, run_id: string | null, current: Assignment | null): Assignment {
  const next = step(topic, run_id);
  return { ...next, begins: current?.subject !== next.subject };
}

function lasting(topic: Topic, subject: string): Assignment {
  return { topic, subject, lasts: true };
}

function brief(subject: string): Assignment {
  return { topic: "other", subject };
}
