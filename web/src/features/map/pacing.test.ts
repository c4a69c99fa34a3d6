import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { RedrawThrottle, restAfterDraw } from "./pacing";

let rested: number;
let pacing: RedrawThrottle;

beforeEach(() => {
  vi.useFakeTimers();
  rested = 0;
  pacing = new RedrawThrottle(() => (rested += 1));
});
afterEach(() => vi.useRealTimers());

it("a fast machine draws each telemetry frame, a slow one rests four times as long as it drew", () => {
  expect([restAfterDraw(16), restAfterDraw(300), restAfterDraw(9000)]).toEqual([0, 1200, 3000]);
  pacing.begin(0);
  pacing.drawn(300);
  vi.advanceTimersByTime(1199);
  expect([pacing.rests, rested]).toEqual([true, 0]);
  vi.advanceTimersByTime(1);
  expect([pacing.rests, rested]).toEqual([false, 1]);
});

it("other drawings meanwhile change nothing", () => {
  pacing.begin(0);
  pacing.begin(200);
  pacing.drawn(300);
  pacing.drawn(320);
  vi.advanceTimersByTime(1200);
  expect([pacing.rests, rested]).toEqual([false, 1]);
});

it("a map that is not drawn at all does not rest for ever", () => {
  pacing.begin(0);
  vi.advanceTimersByTime(2000);
  expect([pacing.rests, rested]).toEqual([false, 1]);
});
