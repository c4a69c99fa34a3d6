import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Offboard } from "../api/types";
import { DONE, FakeWire, GRANTED, REFUSED } from "../testing/fake-wire";
import { HANDS_OFF, Session, type HandsOn } from "./session";
import { neutral, speedsOf } from "./setpoint";

const STILL = neutral(speedsOf("slow", null), "fixed_wing");

let now: HandsOn;
let present: boolean;
let followsHands: boolean;
let session: Session;

const wire = () => FakeWire.all.at(-1) as FakeWire;
const state = (fields: Partial<Offboard>) => wire().events.onState({ state: "leased", lease: null, reason: "", sent: null, cadence: null, tasks: null, flown_by: "commands", order: null, ...fields });

async function leased(): Promise<void> {
  session.take("v3");
  wire().events.onOpen();
  await wire().answer(GRANTED);
}

async function commanded(): Promise<void> {
  await leased();
  void session.enter(false);
  await wire().answer(DONE);
}

beforeEach(() => {
  vi.useFakeTimers();
  FakeWire.all = [];
  [now, present, followsHands] = [HANDS_OFF, true, false];
  session = new Session({
    connect: (_, events) => new FakeWire(events),
    now: () => Date.now(),
    followsHands: () => followsHands,
    ask: () => STILL,
    neutral: () => STILL,
    isPresent: () => present,
    onFreshHands: () => undefined,
    onChange: (next) => (now = next),
  });
});

afterEach(() => {
  session.giveBack();
  vi.useRealTimers();
});

describe("a session for a vehicle that follows no hands", () => {
  it("enters, keeps the lease and leaves without a setpoint, also when leaving is refused", async () => {
    await commanded();
    await vi.advanceTimersByTimeAsync(7000);
    expect([now.phase, now.leads, now.tasksOnly, wire().count("renew")]).toEqual(["flying", "tasks", true, 2]);
    for (let renewed = 0; renewed < 2; renewed += 1) await wire().answer(DONE);
    void session.leave("mission");
    await vi.advanceTimersByTimeAsync(500);
    await wire().answer({ ...REFUSED, code: "conflict" });
    await vi.advanceTimersByTimeAsync(500);
    expect([now.phase, now.refusal?.code, wire().count("setpoint")]).toEqual(["flying", "conflict", 0]);
  });

  it("gives the vehicle to no hands, whoever says that they have it", async () => {
    await commanded();
    session.takeOver();
    wire().events.onTasks({ report: { state: "by_hand" }, tasks: [] } as never);
    void session.queue("Fly the tasks", { type: "queue", do: "resume" });
    await wire().answer(REFUSED);
    await vi.advanceTimersByTimeAsync(1000);
    expect([now.leads, wire().count("setpoint")]).toEqual(["tasks", 0]);
  });

  it("begins at the entry for what was taken hovering, and at the service's word", async () => {
    followsHands = true;
    await leased();
    expect(now.tasksOnly).toBe(false);
    state({ flown_by: "setpoints" });
    expect(now.tasksOnly).toBe(false);
    state({ flown_by: "commands" });
    void session.enter(false);
    await vi.advanceTimersByTimeAsync(1000);
    expect([now.tasksOnly, wire().count("setpoint")]).toEqual([true, 0]);
  });

  it("enters on while the focus moves, for no hands are awaited, but not for a page that is hidden", async () => {
    await leased();
    void session.enter(false);
    session.unattended("focus_left");
    expect(now.phase).toBe("entering");
    session.unattended("hidden");
    expect([now.phase, wire().closed]).toEqual(["off", true]);
  });

  it("lets the lease end when nobody looks at the page, and gives it back with the page", async () => {
    await commanded();
    present = false;
    session.unattended("window_left");
    await vi.advanceTimersByTimeAsync(12_000);
    expect([now.phase, wire().count("renew")]).toEqual(["flying", 0]);
    session.unattended("page_closed");
    expect([now.phase, wire().closed]).toEqual(["off", true]);
  });

  it("is of one lease: the next vehicle may follow hands", async () => {
    await commanded();
    session.giveBack();
    followsHands = true;
    await commanded();
    await vi.advanceTimersByTimeAsync(100);
    expect([now.tasksOnly, wire().count("setpoint") > 0]).toEqual([false, true]);
  });
});
