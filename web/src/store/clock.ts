/** The page's clock: one tick for all that shows an age, so that ages grow together. */

import { signal } from "@preact/signals";

const TICK_MS = 250;
/** More than a busy page's timers are late by. */
const SLEPT_MS = 2_000;

/** performance.now() at the last tick. It does not jump when the computer's clock is set. */
export const now = signal(performance.now());

/**
 * `onWake`: several systems stop performance.now() while they sleep, and what the page shows looks fresh then. A clock
 * that is set forward looks the same.
 */
export function startClock(onWake: () => void): void {
  let ahead = Date.now() - performance.now();
  setInterval(() => {
    if (document.hidden) return;
    now.value = performance.now();
    const before = ahead;
    ahead = Date.now() - now.value;
    if (ahead - before > SLEPT_MS) onWake();
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
