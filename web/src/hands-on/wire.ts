/** One offboard websocket: frames go out with a number, and each answer finds its question. It is never opened again. */

import { parseServerFrame, type Answer, type ClientFrame } from "./frames";
import type { Offboard, TaskQueue } from "../api/types";

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
