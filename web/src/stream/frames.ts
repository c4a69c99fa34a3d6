/** Frames of /api/v1/stream, in the order in which the service sends them: hello, snapshot, then events and telemetry. */

import type { Run, StreamEvent, Vehicle, VehicleState } from "../api/types";

export interface HelloFrame {
  type: "hello";
  gateway: string;
  seq: number;
  server_time: number;
}

export interface SnapshotFrame {
  type: "snapshot";
  seq: number;
  vehicles: Vehicle[];
  runs: Run[];
}

export interface EventFrame {
  type: "event";
  event: StreamEvent;
}

export interface TelemetryFrame {
  type: "telemetry";
  time: number;
  vehicles: Record<string, VehicleState>;
}

export type Frame = HelloFrame | SnapshotFrame | EventFrame | TelemetryFrame;

const KNOWN: ReadonlySet<unknown> = new Set(["hello", "snapshot", "event", "telemetry"]);

/** The frame in a text message; null for a type that this page does not know (a newer service may send more). */
export function parseFrame(message: string): Frame | null {
  const doc: unknown = JSON.parse(message);
  if (typeof doc !== "object" || doc === null || !("type" in doc) || !KNOWN.has(doc.type)) return null;
  return doc as Frame;
}

/** Close codes of the stream that mean something to a client. */
export const CLOSE = { tokenNeeded: 4401, tooSlow: 4408, afterInFuture: 4409 } as const;
