import { describe, expect, it, vi } from "vitest";
import type { Offboard } from "../../api/types";
import { DONE, GRANTED, REFUSED } from "./testing/fake-socket";
import { eachWithFixture, SessionFixture } from "./testing/session-fixture";

let at: SessionFixture;
eachWithFixture(
  () => new SessionFixture("v1", "multicopter", true),
  (bench) => (at = bench),
);

describe("a lease that changes its holder", () => {
  const ACTIVE = {
    state: "active",
    lease: { holder: "ben", expires_in_s: 9, offered_to: "ann" },
    reason: null,
    sent: null,
    rate: null,
  } as unknown as Offboard;

  it("is offered and the offer taken back, and flying goes on meanwhile", async () => {
    await at.flying();
    void at.session.offerLease("ben");
    expect(at.wire.frames.at(-1)).toEqual({ type: "hand_over_lease", to: "ben" });
    await at.wire.answer({ ...DONE, command: "hand_over_lease" });
    void at.session.offerLease(null);
    await at.wire.answer({ ...REFUSED, code: "offboard.lease_lost" });
    expect([at.now.phase, at.now.refusal?.action]).toEqual(["flying", "Withdraw the offer of v1"]);
  });

  it("is flown on at once when it is taken over in flight, with controls that start fresh", async () => {
    at.session.acquireLease("v1");
    at.wire.events.onOpen();
    at.wire.events.onState(ACTIVE);
    await at.wire.answer(GRANTED);
    await vi.advanceTimersByTimeAsync(200);
    expect([at.now.phase, at.fresh, at.wire.count("setpoint")]).toEqual(["flying", 1, 5]);
    expect(at.wire.frames[0]).toEqual({ type: "acquire_lease", rate_hz: 20, override: false });
  });

  it("is taken by override only when that was asked for", async () => {
    at.session.acquireLease("v1", true);
    at.wire.events.onOpen();
    expect(at.wire.frames[0]).toEqual({ type: "acquire_lease", rate_hz: 20, override: true });
  });

  it("ends for the one who had it, with the name of the one who has it now", async () => {
    await at.flying();
    at.wire.events.onState({ ...ACTIVE, lease: { holder: "cat", expires_in_s: 10, offered_to: null } } as Offboard);
    at.wire.events.onClosed(4410, "the lease has ended");
    expect([at.now.phase, at.now.ended]).toEqual(["off", "Taken over by cat."]);
  });
});
