/**
 * Whether anybody is still there at a page that is visible and has the focus: when something was last done at it. What
 * only stays as it is says nothing: a key that something lies on repeats, a stick that lies on its side stays there.
 * Pure.
 */

import { signal } from "@preact/signals";
import { type PadReading, padAxes } from "./controls";
import type { StopReason } from "./sender";

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

// Whether somebody is at the controls: page visible, window focused, focus within the controls or on the map.

/** What may have the focus while a vehicle is flown. */
const WITHIN = ".offboard, .map";

/** Null: somebody is there. */
export function whyUnattended(): StopReason | null {
  if (document.hidden) return "hidden";
  if (!document.hasFocus()) return "window_left";
  return document.activeElement?.closest(WITHIN) ? null : "focus_left";
}

/** Somebody looks at the page, whatever part of it. */
export function isPresent(): boolean {
  return !document.hidden && document.hasFocus();
}

/** Tells every loss as it happens. Returns how to stop. */
export function watchAttention(onLost: (reason: StopReason) => void): () => void {
  const events = new AbortController();
  const options = { signal: events.signal };
  window.addEventListener("blur", () => onLost("window_left"), options);
  window.addEventListener("pagehide", () => onLost("page_closed"), options);
  document.addEventListener("freeze", () => onLost("hidden"), options);
  document.addEventListener("visibilitychange", () => document.hidden && onLost("hidden"), options);
  document.addEventListener(
    "focusin",
    ({ target }) => {
      if (target instanceof Element && target.closest(WITHIN) === null) onLost("focus_left");
    },
    options,
  );
  return () => events.abort();
}

// Whether anybody did something at this page lately: keys, pointers and gamepads count wherever they are used.

const presence = new Presence();
/** As of the last look. */
export const attendance = signal<Attendance>("there");

export function touched(): void {
  presence.touch(performance.now());
  attendance.value = "there";
}

/** To be asked at every moment at which somebody's will is told. */
export function attendanceNow(pad: PadReading | null): Attendance {
  const now_ms = performance.now();
  presence.pad(pad, now_ms);
  attendance.value = presence.at(now_ms);
  return attendance.value;
}

export function watchInput(): void {
  const options = { capture: true, passive: true };
  window.addEventListener("keydown", (event) => presence.key(event, performance.now()), options);
  window.addEventListener(
    "pointermove",
    ({ screenX, screenY }) => presence.pointer(screenX, screenY, performance.now()),
    options,
  );
  for (const press of ["pointerdown", "pointerup", "wheel"])
    window.addEventListener(press, () => presence.touch(performance.now()), options);
}

// Keys that are let go, and Escape, wherever on the page: the focus may have moved while a key was down.

export interface KeyWatcher {
  onRelease(code: string): void;
  onEscape(): void;
}

/** `page`: the window. It hears them on their way down, before any tool can keep one. Returns how to stop. */
export function watchKeys(page: EventTarget, { onRelease, onEscape }: KeyWatcher): () => void {
  const events = new AbortController();
  const options = { capture: true, signal: events.signal };
  page.addEventListener("keyup", (event) => onRelease((event as KeyboardEvent).code), options);
  page.addEventListener("keydown", (event) => isEscape(event as KeyboardEvent) && onEscape(), options);
  return () => events.abort();
}

function isEscape({ code, repeat }: KeyboardEvent): boolean {
  return code === "Escape" && !repeat;
}
