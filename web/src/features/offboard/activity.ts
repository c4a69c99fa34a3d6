/**
 * Whether anybody is still there at a page that is visible and has the focus: when something was last done at it. What
 * only stays as it is says nothing: a key that something lies on repeats, a stick that lies on its side stays there.
 * Pure.
 */

import { signal } from "@preact/signals";
import { type GamepadReading, gamepadAxes } from "./controls";
import type { StopReason } from "./sender";

export const WARN_AFTER_MS = 45_000;
const INACTIVE_AFTER_MS = 60_000;

/** More than a desk that is bumped into moves a mouse, and more than what a page moves under it. */
const MOVED_PX = 4;
/** More than a stick trembles that is not moved. */
const MOVED_AXIS = 0.05;

type Activity = "active" | "warned" | "inactive";

export class ActivityMonitor {
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

  /** A gamepad with an unknown mapping does not count. */
  pad(pad: GamepadReading | null, now_ms: number): void {
    if (pad?.mapping !== "standard") return;
    const next = [...Object.values(gamepadAxes(pad.axes)), ...pad.buttons.map(({ pressed }) => Number(pressed))];
    if (!next.some((value, i) => Math.abs(value - (this.#pad[i] ?? 0)) > MOVED_AXIS)) return;
    this.#pad = next;
    this.touch(now_ms);
  }

  at(now_ms: number): Activity {
    const quiet_ms = now_ms - this.#touched_ms;
    if (quiet_ms >= INACTIVE_AFTER_MS) return "inactive";
    return quiet_ms >= WARN_AFTER_MS ? "warned" : "active";
  }
}

// Whether the controls are attended: page visible, window focused, focus within the controls or on the map.

/** What may have the focus while a vehicle is flown. */
const WITHIN = ".offboard, .map";

/** Null: they are attended. */
export function unattendedReason(): StopReason | null {
  if (document.hidden) return "page_hidden";
  if (!document.hasFocus()) return "window_blurred";
  return document.activeElement?.closest(WITHIN) ? null : "focus_lost";
}

/** The page is visible and focused, whatever part of it. */
export function isPageActive(): boolean {
  return !document.hidden && document.hasFocus();
}

/** Reports every loss of attention as it happens. Returns a function that stops it. */
export function watchAttention(onLost: (reason: StopReason) => void): () => void {
  const events = new AbortController();
  const options = { signal: events.signal };
  window.addEventListener("blur", () => onLost("window_blurred"), options);
  window.addEventListener("pagehide", () => onLost("page_closed"), options);
  document.addEventListener("freeze", () => onLost("page_hidden"), options);
  document.addEventListener("visibilitychange", () => document.hidden && onLost("page_hidden"), options);
  document.addEventListener(
    "focusin",
    ({ target }) => {
      if (target instanceof Element && target.closest(WITHIN) === null) onLost("focus_lost");
    },
    options,
  );
  return () => events.abort();
}

// Whether there was input lately: keys, pointers and gamepads count anywhere on the page.

const presence = new ActivityMonitor();
/** As of the last look. */
export const activity = signal<Activity>("active");

export function recordActivity(): void {
  presence.touch(performance.now());
  activity.value = "active";
}

/** Checked whenever a setpoint is sent. */
export function checkActivity(pad: GamepadReading | null): Activity {
  const now_ms = performance.now();
  presence.pad(pad, now_ms);
  activity.value = presence.at(now_ms);
  return activity.value;
}

export function watchActivity(): void {
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

// Released keys, and Escape, anywhere on the page: the focus may have moved while a key was down.

interface KeyListener {
  onRelease(code: string): void;
  onEscape(): void;
}

/** `page`: the window. It captures them before any tool can stop one. Returns a function that stops it. */
export function watchKeys(page: EventTarget, { onRelease, onEscape }: KeyListener): () => void {
  const events = new AbortController();
  const options = { capture: true, signal: events.signal };
  page.addEventListener("keyup", (event) => onRelease((event as KeyboardEvent).code), options);
  page.addEventListener("keydown", (event) => isEscape(event as KeyboardEvent) && onEscape(), options);
  return () => events.abort();
}

function isEscape({ code, repeat }: KeyboardEvent): boolean {
  return code === "Escape" && !repeat;
}
