import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Offboard } from "../api/types";
import { DONE, FakeWire, GRANTED, REFUSED } from "../testing/fake-wire";
import { HANDS_OFF, Session, type HandsOn } from "./session";
import { neutral, speedsOf } from "./setpoint";

const STILL = neutral(speedsOf("slow", null), "multicopter");

let now: HandsOn;
let fresh: number;
let session: Session;

const wire = () => FakeWire.all.at(-1) as FakeWire;

async function flying(): Promise<void> {
  session.take("v1");
  wire().events.onOpen();
  await wire().answer(GRANTED);
  void session.enter(false);
  await wire().answer(DONE);
}

beforeEach(() => {
  vi.useFakeTimers();
  FakeWire.all = [];
  [now, fresh] = [HANDS_OFF, 0];
  session = new Session({
    connect: (_, events) => new FakeWire(events),
    now: () => Date.now(),
    followsHands: () => true,
    ask: () => STILL,
    neutral: () => STILL,
    isPresent: () => true,
    onFreshHands: () => (fresh += 1),
    onChange: (next) => (now = next),
  });
});

afterEach(() => {
  session.giveBack();
  vi.useRealTimers();
});

describe("a lease that changes hands", () => {
  const ACTIVE = { state: "active", lease: { holder: "ben", expires_in_s: 9, offered_to: "ann" }, reason: "", sent: null, cadence: null } as unknown as Offboard;

  it("is offered and the offer taken back, and flying goes on meanwhile", async () => {
    await flying();
    void session.handOver("ben");
    expect(wire().frames.at(-1)).toEqual({ type: "hand_over", to: "ben" });
    await wire().answer({ ...DONE, what: "hand_over" });
    void session.handOver(null);
    await wire().answer({ ...REFUSED, code: "offboard.lease_lost" });
    expect([now.phase, now.refusal?.doing]).toEqual(["flying", "Take the offer of v1 back"]);
  });

  it("is flown on at once when it is taken over in flight, with hands that start fresh", async () => {
    session.take("v1");
    wire().events.onOpen();
    wire().events.onState(ACTIVE);
    await wire().answer(GRANTED);
    await vi.advanceTimersByTimeAsync(200);
    expect([now.phase, fresh, wire().count("setpoint")]).toEqual(["flying", 1, 5]);
    expect(wire().frames[0]).toEqual({ type: "take", rate_hz: 20, override: false });
  });

  it("is taken by override only when that was asked for", async () => {
    session.take("v1", true);
    wire().events.onOpen();
    expect(wire().frames[0]).toEqual({ type: "take", rate_hz: 20, override: true });
  });

  it("ends for the one who had it, with the name of the one who has it now", async () => {
    await flying();
    wire().events.onState({ ...ACTIVE, lease: { holder: "cat", expires_in_s: 10, offered_to: null } } as Offboard);
    wire().events.onClosed(4410, "the lease has ended");
    expect([now.phase, now.ended]).toEqual(["off", "Taken over by cat."]);
  });
});
