import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { NextFrame } from "./next-frame";

describe("the next frame", () => {
  const frames: (() => void)[] = [];
  beforeEach(() => {
    vi.useFakeTimers();
    frames.length = 0;
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => frames.push(draw));
    vi.stubGlobal("cancelAnimationFrame", (frame: number) => void (frames[frame - 1] = () => undefined));
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
    for (let i = 0; i < 50; i++) next.ask();
    expect(run).not.toHaveBeenCalled();
    drawFrames();
    vi.advanceTimersByTime(10_000);
    expect(run).toHaveBeenCalledTimes(1);
    next.ask();
    drawFrames();
    expect(run).toHaveBeenCalledTimes(2);
  });

  it("comes by the clock where no frame is drawn, as in a hidden page", () => {
    const run = vi.fn();
    const next = new NextFrame(run);
    next.ask();
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
    next.ask();
    next.now();
    drawFrames();
    vi.advanceTimersByTime(1_000);
    expect(run).toHaveBeenCalledTimes(1);
  });
});
