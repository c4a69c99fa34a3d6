/**
 * Groups the events of the feed into groups: an upload, a start, an item, a drop, a vehicle's connection. A group has
 * one line, which grows while it happens. Pure.
 */

import type { EventKind, EventOf, StreamEvent } from "../../api/types";
import { severityTone } from "../../format/mavlink";
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
  /** The assignment of the current step of each run, and of each vehicle without one. */
  private readonly steps = new Map<string, Assignment>();
  /** Types of items as predicted, by run and item. */
  private readonly itemTypes = new Map<string, string>();

  add(event: StreamEvent): void {
    if (event.kind === "run.predicted")
      for (const { item_id, type } of event.data.entries) this.itemTypes.set(itemOf(event, item_id).subject, type);
    const assignment = this.assign(event);
    const of = event.run_id ?? event.vehicle_id ?? "";
    if (assignment.step === true) this.steps.set(of, { ...assignment, begins: false });
    if (assignment.ends === true) this.steps.delete(of);
    const open = this.bySubject.get(assignment.subject) ?? this.storedPlan(event);
    if (open !== undefined && assignment.begins !== true && (assignment.lasts === true || isSoonAfter(open, event))) {
      open.events.push(event);
      this.bySubject.set(assignment.subject, open);
    } else this.open(assignment, event);
  }

  groups(): readonly EventGroup[] {
    return this.all
      .map((group) => ({ ...group, head: headOf(group.events), events: group.events.toReversed() }))
      .reverse();
  }

  private open({ topic, subject }: Assignment, event: StreamEvent): void {
    const itemType = topic === "item" ? (this.itemTypes.get(subject) ?? null) : null;
    const group = { key: `${subject} ${event.position}`, topic, events: [event], itemType };
    this.all.push(group);
    this.bySubject.set(subject, group);
  }

  /** The group of a plan that was stored for this run. */
  private storedPlan(event: StreamEvent): OpenGroup | undefined {
    if (event.kind !== "run.created") return undefined;
    const stored = this.bySubject.get(`plan ${event.data.plan_id}`);
    return stored !== undefined && event.time - (stored.events[0]?.time ?? 0) < STORED_FOR_S ? stored : undefined;
  }

  private assign(event: StreamEvent): Assignment {
    const rule = ASSIGNMENTS[event.kind] as AssignmentRule<EventKind> | undefined; // a newer service may send others
    if (rule === undefined) return { topic: "other", subject: event.kind, begins: true };
    return rule(event as never, this.steps.get(event.run_id ?? event.vehicle_id ?? "") ?? null);
  }
}

function isSoonAfter(open: OpenGroup, event: StreamEvent): boolean {
  return event.time - (open.events.at(-1)?.time ?? 0) < LULL_S;
}

/** The newest of the events that say most. */
function headOf(events: readonly StreamEvent[]): StreamEvent {
  return events.reduce((head, event) => (weight(event) >= weight(head) ? event : head));
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
    return topic === undefined ? (current ?? step("other", run_id)) : nextStep(topic, run_id, current);
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

/** The step that a command begins, or ends. The others belong to the step that the run is at. */
const COMMANDED: Readonly<Partial<Record<EventOf<"run.command">["data"]["command"], Topic>>> = {
  arm: "start",
  start_mission: "start",
  pause: "pause",
  resume: "pause",
  return: "return",
  land: "return",
  change_mission: "change",
};

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
