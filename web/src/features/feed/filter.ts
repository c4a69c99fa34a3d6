/** Which events of the feed somebody wants to read. Pure. */

import type { EventKind, StreamEvent } from "../../api/types";
import { reasonWords } from "../../format/reasons";
import { sentence } from "./format-event";

export const FEEDS = ["news", "all", "vehicle", "delivery", "problems"] as const;
export type FeedChoice = (typeof FEEDS)[number];

const DELIVERY: ReadonlySet<EventKind> = new Set([
  "run.command",
  "run.ack",
  "run.drop",
  "run.attachment",
  "drop.consent_asked",
  "drop.consent_closed",
  "task.gripper",
  "vehicle.command",
]);

/**
 * `news` is all but what state/quiet.ts calls quiet. `vehicle` is the chosen one. A hole in the events is told in
 * every choice.
 */
export function isWanted(event: StreamEvent, choice: FeedChoice, vehicle: string | null): boolean {
  if (event.kind === "page.missing") return true;
  switch (choice) {
    case "news":
    case "all":
      return true;
    case "vehicle":
      return event.vehicle_id === vehicle;
    case "delivery":
      return DELIVERY.has(event.kind);
    case "problems":
      return ["warn", "danger"].includes(sentence(event).tone);
  }
}

// Which events of the feed say nothing new, so that they are shown only to whoever asks for every event. Pure.

/** The seqs of quiet events. `feed` is newest first, as the world keeps it. */
export function quietSeqs(feed: readonly StreamEvent[]): ReadonlySet<number> {
  const said = new Map<string, string>();
  const quiet = new Set<number>();
  for (const event of feed.toReversed()) {
    const news = newsOf(event);
    if (event.kind === "run.item_ended") quiet.add(event.position); // the run's table says it better
    if (news === null) continue;
    const subject = `${event.kind} ${event.run_id} ${news.about}`;
    if (said.get(subject) === news.text) quiet.add(event.position);
    said.set(subject, news.text);
  }
  return quiet;
}

/** What an event says and about what; null for kinds of which each one is news. */
function newsOf(event: StreamEvent): { about: string; text: string } | null {
  switch (event.kind) {
    case "run.changed": {
      const { state, reason } = event.data;
      return { about: "", text: `${state} ${reasonWords(reason)}` };
    }
    case "run.drop": {
      const drop = event.data;
      return {
        about: drop.plan_item_id,
        text: [drop.phase, drop.outcome, drop.certainty, reasonWords(drop.reason), drop.output_evidence ?? ""].join(
          " ",
        ),
      };
    }
    case "run.upload_progress": {
      const { mission_type: list, sent, total, attempt } = event.data;
      return { about: list, text: sent === total ? "done" : `try ${attempt}` };
    }
    default:
      return null;
  }
}
