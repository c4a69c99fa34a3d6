/** Each group of the feed as one sentence that grows with it. Pure. */

import type { EventKind, EventOf, StreamEvent } from "../../api/types";
import { countOf } from "../../format/text";
import { formatDuration } from "../../format/units";
import type { EventGroup, Topic } from "./event-groups";
import { durationOf, type EventText, formatEvent, type PlanNames, runName } from "./format-event";

/** Names runs by their plans where these are known, else by their ids. */
export function formatEventGroup(group: EventGroup, planNames: PlanNames = () => null): EventText {
  return FORMATTERS[group.topic]?.(group, planNames) ?? formatEvent(group.head, planNames);
}

type Formatter = (group: EventGroup, planNames: PlanNames) => EventText | null;

/** Of the topics that have words of their own; null: those of the head. */
const FORMATTERS: { readonly [T in Topic]?: Formatter } = {
  upload: ({ head }, names) => {
    if (head.kind === "run.upload_progress") {
      const { mission_type, sent, total } = head.data;
      return { text: `${head.vehicle_id}: uploading the ${mission_type}: ${sent} of ${total}.`, tone: "info" };
    }
    if (head.kind !== "run.changed" || head.data.state !== "uploaded") return null;
    return { text: `${runName(head.data, names)} was uploaded to ${head.data.vehicle_id}.`, tone: "ok" };
  },
  start: ({ head }, names) => {
    if (head.kind !== "run.changed") return null;
    const { state, vehicle_id } = head.data;
    const name = runName(head.data, names, "run");
    if (state === "starting") return { text: `${vehicle_id} is starting ${name}.`, tone: "info" };
    return state === "flying" ? { text: `${vehicle_id} started ${name}.`, tone: "ok" } : null;
  },
  item: formatItem,
  pause: ({ head, events, pausedAt }, names) => {
    if (head.kind !== "run.changed" || head.data.state !== "flying") return null;
    const isResumed =
      pausedAt !== null || eventsOf(events, "run.command").some(({ data }) => data.command === "resume");
    if (!isResumed) return null;
    const after = pausedAt === null ? "" : ` after ${seconds(head.time - pausedAt)}`;
    return { text: `${head.data.vehicle_id} resumed ${runName(head.data, names, "run")}${after}.`, tone: "ok" };
  },
  end: ({ head }, names) => {
    if (head.kind !== "run.changed" || head.data.state !== "completed") return null;
    const { vehicle_id, started_at, ended_at } = head.data;
    const took = started_at === null || ended_at === null ? null : ended_at - started_at;
    return { text: `${vehicle_id} completed ${runName(head.data, names, "run")}${inTime(took)}.`, tone: "ok" };
  },
  link: ({ head, events }) => {
    const lost = events.find(({ kind }) => kind === "vehicle.link_lost");
    if (head.kind !== "vehicle.link_restored" || lost === undefined) return null;
    return { text: `${head.vehicle_id}: link restored after ${seconds(head.time - lost.time)}.`, tone: "ok" };
  },
  stalls: ({ events }) => {
    const stalls = eventsOf(events, "service.loop_stalled");
    const longest = Math.max(...stalls.map(({ data }) => data.delay_s));
    const times = stalls.length === 1 ? "" : ` ${stalls.length} times`;
    return { text: `Waydrop was blocked${times} for up to ${formatDuration(longest)}.`, tone: "warn" };
  },
  refused: ({ events }) => {
    const count = eventsOf(events, "link.refused").reduce((sum, { data }) => sum + data.count, 0);
    return { text: `Rejected ${countOf(count, "frame")} on the vehicle links.`, tone: "warn" };
  },
  requests: ({ events, head }) =>
    events.length === 1
      ? null
      : { text: `${countOf(events.length, "request")}. Newest: ${formatEvent(head).text}`, tone: "neutral" },
};

/** By item type, while it is under way and after it. */
const ITEM_VERBS: Readonly<Record<string, readonly [(id: string) => string, (id: string) => string]>> = {
  takeoff: [() => "is taking off", () => "took off"],
  waypoint: [(id) => `is flying to “${id}”`, (id) => `reached “${id}”`],
  loiter: [(id) => `is loitering at “${id}”`, completed],
  delay: [(id) => `is waiting at “${id}”`, completed],
  land: [() => "is landing", () => "landed"],
  return_to_launch: [() => "is returning to launch", () => "returned to launch"],
};

function completed(id: string): string {
  return `completed “${id}”`;
}

function formatItem({ head, events, itemType }: EventGroup): EventText | null {
  if (head.kind !== "run.item") return null;
  const ended = eventsOf(events, "run.item_ended")[0];
  const [underWay, over] = ITEM_VERBS[itemType ?? ""] ?? [(id: string) => `is at “${id}”`, completed];
  const isOver = ended !== undefined || head.data.phase === "reached";
  const took = ended === undefined ? null : durationOf(ended.data);
  const text = `${head.vehicle_id} ${(isOver ? over : underWay)(head.data.item_id ?? "")}${inTime(took)}.`;
  return { text, tone: isOver ? "ok" : "info" };
}

function eventsOf<K extends EventKind>(events: readonly StreamEvent[], kind: K): readonly EventOf<K>[] {
  return events.filter((event): event is EventOf<K> => event.kind === kind);
}

/** " in 15 s" */
function inTime(took_s: number | null): string {
  return took_s === null ? "" : ` in ${seconds(took_s)}`;
}

function seconds(time_s: number): string {
  return formatDuration(Math.round(time_s));
}
