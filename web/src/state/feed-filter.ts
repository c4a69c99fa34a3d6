/** Which events of the feed somebody wants to read. Pure. */

import type { StreamEvent } from "../api/types";
import { sentence } from "../format/sentences";

export const FEEDS = ["news", "all", "vehicle", "delivery", "problems"] as const;
export type FeedChoice = (typeof FEEDS)[number];

const DELIVERY: ReadonlySet<string> = new Set(["run.command", "run.ack", "run.drop", "run.attachment", "drop.consent_asked", "drop.consent_closed", "task.gripper", "vehicle.command"]);

/** `news` is all but what state/quiet.ts calls quiet. `vehicle` is the chosen one. A hole in the events is told in every choice. */
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
