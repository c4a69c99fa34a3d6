/**
 * Keeps one websocket to /api/v1/stream open: opens it again after a loss with backoff, asks for what comes after the
 * last event taken in, and says in `status` how things are. It knows nothing of what the frames mean.
 */

import type { StreamFrame } from "./types";

export type ConnectionStatus =
  | { readonly kind: "connecting" }
  | { readonly kind: "live" }
  | { readonly kind: "waiting"; readonly retryAt: number; readonly reason: string }
  /** `rejected`: one was sent. */
  | { readonly kind: "token_needed"; readonly rejected: boolean };

export interface StreamHost {
  /** Last event taken in, for `after=`; null asks for no replay. */
  after(): number | null;
  /** The journal that `after` counts in, as hello named it. */
  gateway(): string | null;
  token(): string | null;
  onStatus(status: ConnectionStatus): void;
  onOpen(): void;
  /** True asks for the connection to be opened again at once. */
  onFrame(frame: StreamFrame): boolean;
  onAfterRefused(): void;
}

/** Frames come several times a second while anything is connected; so much silence means a dead connection. */
const SILENCE_MS = 15_000;
const HANDSHAKE_MS = 8_000;
const AGAIN_MS = 2_000;

export class StreamConnection {
  #socket: WebSocket | null = null;
  #timer: ReturnType<typeof setTimeout> | undefined;
  #attempt = 0;
  #openedAgainAt = -Infinity;

  constructor(private readonly host: StreamHost) {}

  /** Open now, giving up what is open and what was waited for. Also the answer to "try again". */
  open(): void {
    this.#drop();
    this.host.onStatus({ kind: "connecting" });
    const socket = new WebSocket(this.#url(), this.#protocols());
    this.#socket = socket;
    socket.onopen = () => this.host.onOpen();
    socket.onmessage = (message) => this.#onMessage(socket, message);
    socket.onclose = (event) => this.#onClose(socket, event);
    this.#watch(HANDSHAKE_MS);
  }

  /** Open now instead of at the next retry: the network is back, or the page is visible again. */
  wake(anew = false): void {
    if (this.#timer !== undefined && (anew || this.#socket === null)) this.open();
  }

  #url(): string {
    const url = new URL("/api/v1/stream", window.location.href);
    url.protocol = url.protocol.replace("http", "ws");
    const after = this.host.after();
    const gateway = this.host.gateway();
    if (after !== null) url.searchParams.set("after", String(after));
    if (after !== null && gateway !== null) url.searchParams.set("gateway", gateway);
    return url.href;
  }

  #protocols(): string[] {
    const token = this.host.token();
    return token === null ? ["waydrop.v1"] : ["waydrop.v1", `bearer.${token}`];
  }

  #onMessage(socket: WebSocket, message: MessageEvent<string>): void {
    if (socket !== this.#socket) return;
    this.#watch(SILENCE_MS);
    const frame = parseFrame(message.data);
    if (frame === null) return;
    if (this.host.onFrame(frame)) {
      this.#openAgain();
    } else if (frame.type === "snapshot") {
      this.#attempt = 0; // only now is the connection known to be of use
      this.host.onStatus({ kind: "live" });
    }
  }

  /** At once, but never in a tight loop, whatever the service sends. */
  #openAgain(): void {
    const now = performance.now();
    const soon = now - this.#openedAgainAt < AGAIN_MS;
    this.#openedAgainAt = now;
    if (!soon) {
      this.open();
      return;
    }
    this.#drop();
    this.#wait("The event stream had a gap.");
  }

  #onClose(socket: WebSocket, event: CloseEvent): void {
    if (socket !== this.#socket) return;
    this.#drop();
    if (event.code === CLOSE_CODES.tokenNeeded) {
      this.host.onStatus({ kind: "token_needed", rejected: this.host.token() !== null });
      return;
    }
    const { afterInFuture, afterPruned } = CLOSE_CODES;
    if (event.code === afterInFuture || event.code === afterPruned) this.host.onAfterRefused();
    this.#wait(event.code === CLOSE_CODES.tooSlow ? "This page was too slow for the stream." : event.reason);
  }

  #wait(reason: string): void {
    const delayMs = backoffSeconds(this.#attempt++, Math.random()) * 1000;
    this.#timer = setTimeout(() => this.open(), delayMs);
    this.host.onStatus({ kind: "waiting", retryAt: performance.now() + delayMs, reason });
  }

  /** A socket whose peer vanished stays open for minutes without a message: silence closes it. */
  #watch(limitMs: number): void {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#drop();
      this.#wait("The service stopped sending.");
    }, limitMs);
  }

  #drop(): void {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }
}

// How long to wait before the next try to reconnect: doubling, capped, with jitter so that pages do not return in step.

const FIRST_S = 0.5;
const LONGEST_S = 10;

/** Seconds before try number `attempt` (0 is the first after a loss). `random` is in [0, 1). */
export function backoffSeconds(attempt: number, random: number): number {
  const ceiling = Math.min(LONGEST_S, FIRST_S * 2 ** Math.min(attempt, 10));
  return ceiling * (0.5 + 0.5 * random);
}

const KNOWN: ReadonlySet<unknown> = new Set(["hello", "snapshot", "event", "telemetry"]);

/** The frame in a text message; null for a type that this page does not know (a newer service may send more). */
function parseFrame(message: string): StreamFrame | null {
  const doc: unknown = JSON.parse(message);
  if (typeof doc !== "object" || doc === null || !("type" in doc) || !KNOWN.has(doc.type)) return null;
  return doc as StreamFrame;
}

/** Close codes of the stream that mean something to a client. */
const CLOSE_CODES = { tokenNeeded: 4401, tooSlow: 4408, afterInFuture: 4409, afterPruned: 4411 } as const;
