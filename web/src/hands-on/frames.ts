/** Frames of the offboard websocket, both ways (docs/offboard.md). */

import type { AuditEntry, Clamp, Offboard } from "../api/types";
import type { Setpoint } from "./setpoint";

export type Destination = "hold" | "mission" | "return";

export type ClientFrame =
  | { type: "take"; rate_hz: number; override: boolean }
  | { type: "hand_over"; to: string | null }
  | { type: "renew" }
  | { type: "enter"; sticks_held: boolean }
  | { type: "setpoint"; setpoint: Setpoint }
  | { type: "leave"; to: Destination }
  | { type: "release" };

export interface StateFrame {
  type: "state";
  offboard: Offboard;
}

interface Answered {
  id: number | null;
}

export interface RefusedFrame extends Answered {
  type: "refused";
  code: string;
  detail: string;
  hint: string;
  extra: Record<string, unknown>;
}

export type Answer =
  | ({ type: "granted"; holder: string; expires_in_s: number } & Answered)
  | ({ type: "taken"; clamped: Clamp[] } & Answered)
  | ({ type: "done"; what: string; audit: AuditEntry[] } & Answered)
  | RefusedFrame;

const ANSWERS: ReadonlySet<unknown> = new Set(["granted", "taken", "done", "refused"]);

/** Null for a type that this page does not know. */
export function parseServerFrame(message: string): StateFrame | Answer | null {
  const doc: unknown = JSON.parse(message);
  if (typeof doc !== "object" || doc === null || !("type" in doc)) return null;
  return doc.type === "state" || ANSWERS.has(doc.type) ? (doc as StateFrame | Answer) : null;
}
