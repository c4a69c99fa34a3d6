/** Which events of the feed are shown. Pure. */

import type { EventKind, StreamEvent } from "../../api/types";
import { formatEvent } from "./format-event";

export const FEED_FILTERS = ["highlights", "all", "vehicle", "delivery", "problems"] as const;
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

/** `vehicle` is the selected one. Every filter shows a gap in the events; highlights leave out `repeatedSeqs`. */
export function matchesFilter(event: StreamEvent, filter: FeedFilter, vehicle: string | null): boolean {
  if (event.kind === "page.missing") return true;
  switch (filter) {
    case "highlights":
    case "all":
      return true;
    case "vehicle":
      return event.vehicle_id === vehicle;
    case "delivery":
      return DELIVERY.has(event.kind);
    case "problems": {
      const { tone } = formatEvent(event);
      return tone === "warn" || tone === "danger";
    }
  }
}

/** The numbers of events that repeat what an earlier one said. `feed` has the newest event first. */
export function repeatedSeqs(feed: readonly StreamEvent[]): ReadonlySet<number> {
  const said = new Map<string, string>();
  const repeated = new Set<number>();
  for (const event of feed.toReversed()) {
    const state = stateIn(event);
    if (event.kind === "run.item_ended") repeated.add(event.position); // the comparison of the run shows it
    if (state === null) continue;
    const subject = `${event.kind} ${event.run_id} ${state.of}`;
    if (said.get(subject) === state.value) repeated.add(event.position);
    said.set(subject, state.value);
  }
  return repeated;
}

/** The state that an event reports, and what it is the state of; null for kinds that never repeat. */
function stateIn(event: StreamEvent): { readonly of: string; readonly value: string } | null {
  switch (event.kind) {
    case "run.changed": {
      const { state, reason } = event.data;
      return { of: "", value: JSON.stringify([state, reason]) };
    }
    case "run.drop": {
      const { plan_item_id, phase, outcome, certainty, reason, output_evidence } = event.data;
      return { of: plan_item_id, value: JSON.stringify([phase, outcome, certainty, reason, output_evidence]) };
    }
    case "run.upload_progress": {
      const { mission_type, sent, total, attempt } = event.data;
      return { of: mission_type, value: sent === total ? "done" : `try ${attempt}` };
    }
    default:
      return null;
  }
}
