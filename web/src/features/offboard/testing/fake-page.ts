/** What a page has around it, for tests of a session in Node: window, document, focus, gamepads and sockets. */

import { vi } from "vitest";
import type { GamepadReading } from "../controls";

/** A service behind every socket that grants and does what it is asked, at once. */
export class FakeSocket {
  static readonly OPEN = 1;
  static all: FakeSocket[] = [];
  readonly readyState = FakeSocket.OPEN;
  readonly sent: Record<string, unknown>[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((message: { data: string }) => void) | null = null;
  onclose: ((event: { code: number; reason: string }) => void) | null = null;

  constructor() {
    FakeSocket.all.push(this);
    setTimeout(() => this.onopen?.(), 1);
  }

  /** Refused by the service from now on: frames of this type. */
  static refuses: string | null = null;

  send(text: string): void {
    const frame = JSON.parse(text) as { type: string; id: number };
    this.sent.push(frame);
    setTimeout(() => this.tell(answerTo(frame)), 1);
  }

  tell(frame: object): void {
    this.onmessage?.({ data: JSON.stringify(frame) });
  }

  close(): void {
    this.onmessage = null;
  }
}

function answerTo({ type, id }: { type: string; id: number }): object {
  if (type === FakeSocket.refuses)
    return { type: "error", id, code: "state.conflict", detail: "not now", hint: "", extra: {} };
  if (type === "acquire_lease") return { type: "lease_granted", id, holder: "ann", expires_in_s: 10 };
  if (type === "setpoint") return { type: "setpoint_ack", id, clamped: [] };
  if (type === "task") return { type: "queued", id, task_id: `t${id}` };
  return { type: "done", id, command: type, audit: [] };
}

class FakeElement extends EventTarget {
  constructor(readonly within: boolean) {
    super();
  }

  closest(): FakeElement | null {
    return this.within ? this : null;
  }
}

export interface FakePage {
  readonly window: EventTarget;
  readonly document: EventTarget & { hidden: boolean; hasFocus: () => boolean; activeElement: FakeElement };
  /** The focus goes there, within the controls or out of them, as a browser tells it. */
  focus(within: boolean): void;
  pad: GamepadReading | null;
}

/** Everything that the session's modules look for when they are imported. */
export function stubPage(hash: string): FakePage {
  const window = Object.assign(new EventTarget(), { location: { href: "http://page.test/" } });
  const document = Object.assign(new EventTarget(), {
    hidden: false,
    hasFocus: () => true,
    activeElement: new FakeElement(true),
  });
  const page: FakePage = {
    window,
    document,
    pad: null,
    focus: (within) => {
      document.activeElement = new FakeElement(within);
      document.dispatchEvent(Object.defineProperty(new Event("focusin"), "target", { value: document.activeElement }));
    },
  };
  vi.stubGlobal("window", window);
  vi.stubGlobal("document", document);
  vi.stubGlobal("Element", FakeElement);
  vi.stubGlobal("location", { hash });
  vi.stubGlobal("sessionStorage", { getItem: () => null });
  vi.stubGlobal("navigator", { getGamepads: () => [page.pad] });
  vi.stubGlobal("WebSocket", FakeSocket);
  vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, 16));
  vi.stubGlobal("cancelAnimationFrame", (handle: ReturnType<typeof setTimeout>) => clearTimeout(handle));
  return page;
}
