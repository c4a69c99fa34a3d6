import { signal } from "@preact/signals";
import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { slowed } from "./slowed";

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

it("a slowed signal shows the first change at once, few of many, and always the last", () => {
  const source = signal(0);
  const shown = slowed(source, 500);
  const seen: number[] = [];
  shown.subscribe((value) => seen.push(value));
  for (let i = 1; i <= 12; i++) {
    source.value = i;
    vi.advanceTimersByTime(100);
  }
  vi.advanceTimersByTime(1000);
  expect(seen[1]).toBe(1);
  expect(seen.at(-1)).toBe(12);
  expect(seen.length).toBeLessThanOrEqual(6);
});

it("a change after a pause is shown at once again", () => {
  const source = signal(0);
  const shown = slowed(source, 500);
  source.value = 1;
  vi.advanceTimersByTime(2000);
  source.value = 2;
  expect(shown.value).toBe(2);
});
