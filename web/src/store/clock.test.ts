import { afterEach, expect, it, vi } from "vitest";
import { startClock } from "./clock";

afterEach(() => vi.useRealTimers());

it("a sleep that performance.now() did not count is noticed once, when somebody looks; a slow drift is none", () => {
  vi.useFakeTimers();
  const page = { hidden: false };
  vi.stubGlobal("document", page);
  const wakes: number[] = [];
  startClock(() => wakes.push(Date.now()));
  const gain = (ms: number) => {
    vi.setSystemTime(Date.now() + ms);
    vi.advanceTimersByTime(1_000);
    return wakes.length;
  };
  expect([gain(0), gain(60_000), gain(0), gain(1_000), gain(1_500), gain(-60_000)]).toEqual([0, 1, 1, 1, 1, 1]);
  page.hidden = true;
  expect(gain(60_000)).toBe(1);
  page.hidden = false;
  expect(gain(0)).toBe(2);
});
