import { signal } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { NextFrame, throttled } from "./frame-pacing";

describe("the next frame", () => {
  const frames: (() => void)[] = [];
  beforeEach(() => {
    vi.useFakeTimers();
    frames.length = 0;
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => frames.push(draw));
    vi.stubGlobal("cancelAnimationFrame", (frame: number) => {
      frames[frame - 1] = () => undefined;
    });
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });
  const drawFrames = () => {
    for (const draw of frames.splice(0)) draw();
  };

  it("comes once for all that was asked before it, and again for what is asked after it", () => {
    const run = vi.fn();
    const next = new NextFrame(run);
    for (let i = 0; i < 50; i++) next.request();
    expect(run).not.toHaveBeenCalled();
    drawFrames();
    vi.advanceTimersByTime(10_000);
    expect(run).toHaveBeenCalledTimes(1);
    next.request();
    drawFrames();
    expect(run).toHaveBeenCalledTimes(2);
  });

  it("comes by the clock where no frame is drawn, as in a hidden page", () => {
    const run = vi.fn();
    const next = new NextFrame(run);
    next.request();
    vi.advanceTimersByTime(249);
    expect(run).not.toHaveBeenCalled();
    vi.advanceTimersByTime(1);
    expect(run).toHaveBeenCalledTimes(1);
    drawFrames();
    expect(run).toHaveBeenCalledTimes(1);
  });

  it("can be done at once, and is then not done again", () => {
    const run = vi.fn();
    const next = new NextFrame(run);
    next.request();
    next.now();
    drawFrames();
    vi.advanceTimersByTime(1_000);
    expect(run).toHaveBeenCalledTimes(1);
  });
});

beforeEach(() => vi.useFakeTimers());
afterEach(() => vi.useRealTimers());

it("a slowed signal shows the first change at once, few of many, and always the last", () => {
  const source = signal(0);
  const shown = throttled(source, 500);
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
  const shown = throttled(source, 500);
  source.value = 1;
  vi.advanceTimersByTime(2000);
  source.value = 2;
  expect(shown.value).toBe(2);
});
