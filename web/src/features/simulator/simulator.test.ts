import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

const NONE = { vehicles: [], faults: [], speed: null };
const SILENT = {
  ...NONE,
  configured: true,
  available: false,
  reason: "the simulator at 127.0.0.1:9 did not answer within 2 s",
};
const ABSENT = {
  ...NONE,
  configured: false,
  available: false,
  reason: "this service was started without simulated vehicles",
};
const THERE = { ...NONE, configured: true, available: true, reason: null };

describe("the simulator behind the service", () => {
  let answer: object;
  let asked = 0;
  let found: typeof import("./simulator");

  beforeEach(async () => {
    asked = 0;
    vi.useFakeTimers();
    vi.stubGlobal("document", { hidden: false });
    vi.stubGlobal("fetch", async () => {
      asked += 1;
      return Response.json(answer);
    });
    vi.resetModules();
    const { status } = await import("../../store/store");
    found = await import("./simulator");
    status.value = { kind: "live" };
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  async function watchFor(ms: number): Promise<void> {
    await vi.advanceTimersByTimeAsync(ms);
  }

  it("is asked again until it answers, and then no more", async () => {
    answer = SILENT;
    found.watchSimulator();
    await watchFor(11_000);
    expect([found.hasSimulator.value, asked]).toEqual([false, 3]);
    answer = THERE;
    await watchFor(60_000);
    expect([found.hasSimulator.value, asked]).toEqual([true, 4]);
  });

  it("is asked for once where there is none", async () => {
    answer = ABSENT;
    found.watchSimulator();
    await watchFor(60_000);
    expect([found.hasSimulator.value, asked]).toEqual([false, 1]);
  });
});
