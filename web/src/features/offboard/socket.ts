/**
 * One offboard websocket: frames go out with a number, and each answer finds its question. It is never opened again.
 */

import type {
  ClientFrame,
  Offboard,
  QueueRequest,
  ServerAnswer,
  StateFrame,
  TaskPoint,
  TaskQueue,
  TasksFrame,
} from "../../api/types";

export interface OffboardSocketEvents {
  onOpen(): void;
  onState(offboard: Offboard): void;
  /** The task queue, on every change and once a second from the first task on. */
  onTasks(queue: TaskQueue): void;
  /** An answer without a pending request: a setpoint's. */
  onAnswer(answer: ServerAnswer): void;
  /** The socket closed; not called after `close`. */
  onClosed(code: number, reason: string): void;
}

export interface OffboardSocket {
  /** Never settles if the socket closes first: then `onClosed` is called. */
  request(frame: ClientFrame): Promise<ServerAnswer>;
  /** Returns the number that comes back with the answer. */
  post(frame: ClientFrame): number;
  close(): void;
}

export function openOffboardSocket(
  vehicle: string,
  token: string | null,
  events: OffboardSocketEvents,
): OffboardSocket {
  const url = new URL(`/api/v1/vehicles/${encodeURIComponent(vehicle)}/offboard`, window.location.href);
  url.protocol = url.protocol.replace("http", "ws");
  const socket = new WebSocket(url.href, token === null ? ["waydrop.v1"] : ["waydrop.v1", `bearer.${token}`]);
  const waiting = new Map<number, (answer: ServerAnswer) => void>();
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
    request: (frame) => new Promise((resolve) => waiting.set(post(frame), resolve)),
    close: () => {
      open = false;
      socket.close();
    },
  };
}

/** Where a target is now, and how it moves. */
export interface TargetMotion {
  readonly point: TaskPoint;
  readonly motion: { readonly north_m_s: number; readonly east_m_s: number };
}

/** A first task is flown as soon as the vehicle is under control; one behind a queue that stands waits with it. */
export function startsTasks(frame: QueueRequest, tasks: TaskQueue | null): boolean {
  if (frame.type === "queue") return frame.action === "resume";
  return frame.type === "task" && (tasks === null || tasks.report.state === "idle");
}

const ANSWERS: ReadonlySet<unknown> = new Set(["lease_granted", "setpoint_ack", "queued", "done", "error"]);

/** Null for a type that this page does not know. */
function parseServerFrame(message: string): StateFrame | TasksFrame | ServerAnswer | null {
  const doc: unknown = JSON.parse(message);
  if (typeof doc !== "object" || doc === null || !("type" in doc)) return null;
  const known = doc.type === "state" || doc.type === "tasks" || ANSWERS.has(doc.type);
  return known ? (doc as StateFrame | TasksFrame | ServerAnswer) : null;
}
