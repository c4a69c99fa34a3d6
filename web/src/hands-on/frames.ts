/** Frames of the offboard websocket, both ways (docs/offboard.md). */

import type { AuditEntry, Clamp, InsertMode, Offboard, QueueAction, Task, TaskQueue, TaskTerms, WhenEmpty } from "../api/types";
import type { TargetNow } from "../targets/following";
import type { Setpoint } from "./setpoint";

export type Destination = "hold" | "mission" | "return";

/** What is asked of the task queue (docs/tasks.md). */
export type QueueAsk =
  | { type: "task"; task: Task; insert: InsertMode; when_empty: WhenEmpty }
  | { type: "queue"; action: QueueAction }
  | { type: "move"; task_id: string; before: string | null }
  | { type: "change"; task_id: string; change: TaskTerms }
  | ({ type: "target"; task_id: string } & TargetNow)
  | { type: "remove"; task_id: string };

/** A first task is flown as soon as the vehicle is under control; one behind a queue that stands waits with it. */
export function givesLead(frame: QueueAsk, tasks: TaskQueue | null): boolean {
  if (frame.type === "queue") return frame.action === "resume";
  return frame.type === "task" && (tasks === null || tasks.report.state === "idle");
}

export type ClientFrame =
  | QueueAsk
  | { type: "acquire_lease"; rate_hz: number; override: boolean }
  | { type: "hand_over_lease"; to: string | null }
  | { type: "renew_lease" }
  | { type: "enter"; sticks_held: boolean }
  | { type: "setpoint"; setpoint: Setpoint }
  | { type: "leave"; to: Destination }
  | { type: "release_lease" };

export interface StateFrame {
  type: "state";
  offboard: Offboard;
}

export interface TasksFrame {
  type: "tasks";
  queue: TaskQueue;
}

interface Answered {
  id: number | null;
}

export interface RefusedFrame extends Answered {
  type: "error";
  code: string;
  detail: string;
  hint: string;
  extra: Record<string, unknown>;
}

export type Answer =
  | ({ type: "lease_granted"; holder: string; expires_in_s: number } & Answered)
  | ({ type: "setpoint_ack"; clamped: Clamp[] } & Answered)
  | ({ type: "queued"; task_id: string } & Answered)
  | ({ type: "done"; command: string; audit: AuditEntry[] } & Answered)
  | RefusedFrame;

const ANSWERS: ReadonlySet<unknown> = new Set(["lease_granted", "setpoint_ack", "queued", "done", "error"]);

/** Null for a type that this page does not know. */
export function parseServerFrame(message: string): StateFrame | TasksFrame | Answer | null {
  const doc: unknown = JSON.parse(message);
  if (typeof doc !== "object" || doc === null || !("type" in doc)) return null;
  const known = doc.type === "state" || doc.type === "tasks" || ANSWERS.has(doc.type);
  return known ? (doc as StateFrame | TasksFrame | Answer) : null;
}
