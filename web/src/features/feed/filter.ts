/** Which groups of the feed are shown. Pure. */

import type { EventKind, StreamEvent } from "../../api/types";
import { type EventGroup, isServiceGroup } from "./event-groups";
import { formatEvent } from "./format-event";

export const FEED_FILTERS = ["highlights", "run", "vehicle", "delivery", "problems", "service", "all"] as const;
export type FeedFilter = (typeof FEED_FILTERS)[number];

const DELIVERY: ReadonlySet<EventKind> = new Set<EventKind>([
  "run.command",
  "run.ack",
  "run.drop",
  "run.attachment",
  "drop.consent_asked",
  "drop.consent_closed",
  "task.gripper",
  "vehicle.command",
]);

interface Selected {
  readonly vehicle: string | null;
  readonly run: string | null;
}

/** Every filter shows a gap in the events. */
export function matchesFilter(group: EventGroup, filter: FeedFilter, { vehicle, run }: Selected): boolean {
  const has = (test: (event: StreamEvent) => boolean) => group.events.some(test);
  if (group.head.kind === "page.missing") return true;
  switch (filter) {
    case "all":
      return true;
    case "highlights":
      return !isServiceGroup(group);
    case "run":
      return has(({ run_id }) => run_id !== null && run_id === run);
    case "vehicle":
      return has(({ vehicle_id }) => vehicle_id !== null && vehicle_id === vehicle);
    case "delivery":
      return has(({ kind }) => DELIVERY.has(kind));
    case "problems":
      return !isServiceGroup(group) && has(isProblem);
    case "service":
      return isServiceGroup(group);
  }
}

function isProblem(event: StreamEvent): boolean {
  const { tone } = formatEvent(event);
  return tone === "warn" || tone === "danger";
}
