/**
 * Sends setpoints at a steady rate while the controls are attended. It never queues and never resumes: what
 * stops it stops it for good, and the vehicle is then held by the service's dead-man.
 */

import type { Setpoint } from "./setpoint";

/** Why nothing is sent any more. */
export type StopReason =
  | "page_hidden"
  | "window_blurred"
  | "focus_lost"
  | "page_closed"
  | "no_input"
  | "page_stalled"
  | "no_answer";

interface SenderHost {
  /** Milliseconds of a clock that never jumps. */
  now(): number;
  /** The setpoint to send now, or why there is none. */
  nextSetpoint(): Setpoint | StopReason;
  /** Sends it; the number comes back with `answered`. */
  send(setpoint: Setpoint): number;
  onStop(reason: StopReason): void;
}

/**
 * As the service's dead-man: nothing older is ever sent, so nothing is sent behind an answer that is late by so much.
 */
const LATE_MS = 400;
/** The service has given up by then. */
const GONE_MS = 1000;

export class SetpointSender {
  readonly #period_ms: number;
  readonly #flying = new Map<number, number>(); // number -> when it was sent, oldest first
  #timer: ReturnType<typeof setTimeout> | undefined;
  #due = 0;
  #last = 0;
  /** How long the newest answer took; null before the first. */
  answer_ms: number | null = null;

  constructor(
    private readonly host: SenderHost,
    rate_hz: number,
  ) {
    this.#period_ms = 1000 / rate_hz;
  }

  get sending(): boolean {
    return this.#timer !== undefined;
  }

  start(): void {
    if (this.sending) return;
    this.#flying.clear();
    this.answer_ms = null;
    this.#due = this.#last = this.host.now();
    this.#tick();
  }

  /** Without a word to the host: it knows. */
  stop(): void {
    clearTimeout(this.#timer);
    this.#timer = undefined;
  }

  /** The service has answered this one, and so all that were sent before it. */
  answered(number: number): void {
    const sent = this.#flying.get(number);
    if (sent === undefined) return;
    this.answer_ms = this.host.now() - sent;
    for (const other of [...this.#flying.keys()]) {
      this.#flying.delete(other);
      if (other === number) return;
    }
  }

  #tick(): void {
    const now = this.host.now();
    const reason = this.#reasonToStop(now);
    const asked = reason ?? this.host.nextSetpoint();
    if (typeof asked === "string") {
      this.#end(asked);
      return;
    }
    this.#last = now;
    if (this.#waited(now) < LATE_MS) this.#flying.set(this.host.send(asked), now);
    // a missed moment is not made up for
    this.#due += this.#period_ms * (1 + Math.max(0, Math.floor((now - this.#due) / this.#period_ms)));
    this.#timer = setTimeout(() => this.#tick(), this.#due - now);
  }

  #reasonToStop(now: number): StopReason | null {
    if (now - this.#last > GONE_MS) return "page_stalled"; // what was held then may not be held now
    return this.#waited(now) > GONE_MS ? "no_answer" : null;
  }

  /** For how long the oldest unanswered setpoint has been on its way. */
  #waited(now: number): number {
    const [oldest] = this.#flying.values();
    return oldest === undefined ? 0 : now - oldest;
  }

  #end(reason: StopReason): void {
    this.stop();
    this.host.onStop(reason);
  }
}
