/** An offboard websocket for tests of a session: it keeps what was sent, and answers when the test says so. */

import { vi } from "vitest";
import type { ClientFrame, ServerAnswer } from "../../../api/types";
import type { OffboardSocketEvents } from "../socket";

export const GRANTED = { type: "lease_granted", id: 1, holder: "ann", expires_in_s: 10 } satisfies ServerAnswer;
export const DONE = { type: "done", id: 1, command: "enter", audit: [] } satisfies ServerAnswer;
export const REFUSED = {
  type: "error",
  id: 1,
  code: "offboard.lease_held",
  detail: "ben has it",
  hint: "wait",
  extra: {},
} satisfies ServerAnswer;

export class FakeWire {
  static all: FakeWire[] = [];
  readonly frames: ClientFrame[] = [];
  closed = false;
  #waits: ((answer: ServerAnswer) => void)[] = [];

  constructor(readonly events: OffboardSocketEvents) {
    FakeWire.all.push(this);
  }

  post(frame: ClientFrame): number {
    this.frames.push(frame);
    if (frame.type === "setpoint")
      setTimeout(() => this.events.onAnswer({ type: "setpoint_ack", id: number, clamped: [] }), 2);
    const number = this.frames.length;
    return number;
  }

  request(frame: ClientFrame): Promise<ServerAnswer> {
    this.post(frame);
    return new Promise((resolve) => this.#waits.push(resolve));
  }

  async answer(answer: ServerAnswer): Promise<void> {
    this.#waits.shift()?.(answer);
    await vi.advanceTimersByTimeAsync(0);
  }

  close(): void {
    this.closed = true;
  }

  count(type: ClientFrame["type"]): number {
    return this.frames.filter((frame) => frame.type === type).length;
  }
}
