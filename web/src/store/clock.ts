/** The page's clock: one tick for all that shows an age, so that ages grow together. */

import { signal } from "@preact/signals";

const TICK_MS = 250;

/** performance.now() at the last tick. It does not jump when the computer's clock is set. */
export const now = signal(performance.now());

export function startClock(): void {
  setInterval(() => {
    if (!document.hidden) now.value = performance.now();
  }, TICK_MS);
}

/**
 * The service's time (Unix seconds), from how far it is ahead of this page's clock; null before the first frame.
 */
export function serviceNow(ahead_s: number | null): number | null {
  return ahead_s === null ? null : ahead_s + now.value / 1000;
}

/** Seconds since `at` (ms of performance.now()), never negative. */
export function secondsSince(at: number): number {
  return Math.max(0, (now.value - at) / 1000);
}
