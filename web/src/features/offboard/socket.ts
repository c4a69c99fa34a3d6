/**
 * One offboard websocket: frames go out with a number, and each answer finds its question. It is never opened again.
 */

import type {
  AuditEntry,
  Clamp,
  InsertMode,
  Offboard,
  QueueAction,
  Task,
  TaskPoint,
  TaskQueue,
  TaskTerms,
  WhenEmpty,
} from "../../api/types";
import type { Setpoint } from "./setpoint";

export interface WireEvents {
  onOpen(): void;
  onState(offboard: Offboard): void;
  /** The task queue, on every change and once a second from the first task on. */
  onTasks(queue: TaskQueue): void;
  /** An answer that nobody awaits: a setpoint's. */
  onAnswer(answer: Answer): void;
  /** It has ended and nothing will come any more; not told after `close`. */
  onClosed(code: number, reason: string): void;
}

export interface Wire {
  /** Never settles if the socket ends first: that is told by `onClosed`. */
  ask(frame: ClientFrame): Promise<Answer>;
  /** Returns the number that comes back with the answer. */
  post(frame: ClientFrame): number;
  close(): void;
}

export function openWire(vehicle: string, token: string | null, events: WireEvents): Wire {
  const url = new URL(`/api/v1/vehicles/${encodeURIComponent(vehicle)}/offboard`, window.location.href);
  url.protocol = url.protocol.replace("http", "ws");
  const socket = new WebSocket(url.href, token === null ? ["waydrop.v1"] : ["waydrop.v1", `bearer.${token}`]);
  const waiting = new Map<number, (answer: Answer) => void>();
  let number = 0;
  let open = true;

  socket.onopen = () => open && events.onOpen();
  socket.onmessage = (message: MessageEvent<string>) => {
    const frame = open ? parseServerFrame(message.data) : null;
    if (frame === null) return;
    if (frame.type === "state") return events.onState(frame.offboard);
    if (frame.type === "tasks") return events.onTasks(frame.queue);
    const tell = frame.id === null ? undefined : waiting.get(frame.id);
    if (frame.id !== null) waiting.delete(frame.id);
    (tell ?? events.onAnswer)(frame);
  };
  socket.onclose = (event) => {
    if (!open) return;
    open = false;
    events.onClosed(event.code, event.reason);
  };

  const post = (frame: ClientFrame): number => {
    number += 1;
    if (open && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ ...frame, id: number }));
    return number;
  };
  return {
    post,
    ask: (frame) => new Promise((resolve) => waiting.set(post(frame), resolve)),
    close: () => {
      open = false;
      socket.close();
    },
  };
}

// Frames of the offboard websocket, both ways (docs/reference/offboard.md).

export type Destination = "hold" | "mission" | "return";

/** Where a target is now, and how it moves. */
export interface TargetMotion {
  readonly point: TaskPoint;
  readonly motion: { readonly north_m_s: number; readonly east_m_s: number };
}

/** What is asked of the task queue (docs/reference/tasks.md). */
export type QueueAsk =
  | { type: "task"; task: Task; insert: InsertMode; when_empty: WhenEmpty }
  | { type: "queue"; action: QueueAction }
  | { type: "move"; task_id: string; before: string | null }
  | { type: "change"; task_id: string; change: TaskTerms }
  | ({ type: "target"; task_id: string } & TargetMotion)
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
