/**
 * Whether anybody is still there at a page that is visible and has the focus: when something was last done at it. What
 * only stays as it is says nothing: a key that something lies on repeats, a stick that lies on its side stays there. Pure.
 */

import { padAxes, type PadReading } from "./gamepad";

export const WARN_AFTER_MS = 45_000;
const NOBODY_AFTER_MS = 60_000;

/** More than a desk that is bumped into moves a mouse, and more than what a page moves under it. */
const MOVED_PX = 4;
/** More than a stick trembles that is not moved. */
const MOVED_AXIS = 0.05;

export type Attendance = "there" | "warned" | "nobody";

export class Presence {
  #touched_ms = 0;
  #pointer: readonly [x: number, y: number] = [0, 0];
  #pad: readonly number[] = [];

  /** Something was surely done: a press of a finger, a mouse or a wheel, or controls that begin. */
  touch(now_ms: number): void {
    this.#touched_ms = now_ms;
  }

  key({ repeat }: { readonly repeat: boolean }, now_ms: number): void {
    if (!repeat) this.touch(now_ms);
  }

  /** Where the pointer is on the screen. */
  pointer(x: number, y: number, now_ms: number): void {
    if (Math.hypot(x - this.#pointer[0], y - this.#pointer[1]) < MOVED_PX) return;
    this.#pointer = [x, y];
    this.touch(now_ms);
  }

  /** A gamepad whose axes nobody knows says nothing. */
  pad(pad: PadReading | null, now_ms: number): void {
    if (pad?.mapping !== "standard") return;
    const next = [...Object.values(padAxes(pad.axes)), ...pad.buttons.map(({ pressed }) => Number(pressed))];
    if (!next.some((value, i) => Math.abs(value - (this.#pad[i] ?? 0)) > MOVED_AXIS)) return;
    this.#pad = next;
    this.touch(now_ms);
  }

  at(now_ms: number): Attendance {
    const quiet_ms = now_ms - this.#touched_ms;
    if (quiet_ms >= NOBODY_AFTER_MS) return "nobody";
    return quiet_ms >= WARN_AFTER_MS ? "warned" : "there";
  }
}
