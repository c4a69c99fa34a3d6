import { describe, expect, it, vi } from "vitest";
import type { Offboard } from "../../api/types";
import { DONE, REFUSED } from "./testing/fake-socket";
import { eachWithFixture, SessionFixture } from "./testing/session-fixture";

let at: SessionFixture;
eachWithFixture(
  () => new SessionFixture("v3", "fixed_wing", false),
  (bench) => (at = bench),
);
const state = (fields: Partial<Offboard>) =>
  at.wire.events.onState({
    state: "leased",
    lease: null,
    reason: null,
    sent: null,
    rate: null,
    tasks: null,
    control_method: "commands",
    command: null,
    ...fields,
  });

describe("a session for a vehicle that follows no controls", () => {
  it("enters, keeps the lease and leaves without a setpoint, also when leaving is refused", async () => {
    await at.flying();
    await vi.advanceTimersByTimeAsync(7000);
    expect([at.now.phase, at.now.source, at.now.tasksOnly, at.wire.count("renew_lease")]).toEqual([
      "flying",
      "tasks",
      true,
      2,
    ]);
    for (let renewed = 0; renewed < 2; renewed += 1) await at.wire.answer(DONE);
    void at.session.leave("mission");
    await vi.advanceTimersByTimeAsync(500);
    await at.wire.answer({ ...REFUSED, code: "state.conflict" });
    await vi.advanceTimersByTimeAsync(500);
    expect([at.now.phase, at.now.refusal?.code, at.wire.count("setpoint")]).toEqual(["flying", "state.conflict", 0]);
  });

  it("gives the vehicle to no controls, whatever claims them", async () => {
    await at.flying();
    at.session.switchToControls();
    at.wire.events.onTasks({ report: { state: "manual" }, tasks: [] } as never);
    void at.session.queue("Fly the tasks", { type: "queue", action: "resume" });
    await at.wire.answer(REFUSED);
    await vi.advanceTimersByTimeAsync(1000);
    expect([at.now.source, at.wire.count("setpoint")]).toEqual(["tasks", 0]);
  });

  it("begins at the entry for what was taken hovering, and at the service's word", async () => {
    at.followsControls = true;
    await at.leased();
    expect(at.now.tasksOnly).toBe(false);
    state({ control_method: "setpoints" });
    expect(at.now.tasksOnly).toBe(false);
    state({ control_method: "commands" });
    void at.session.enter(false);
    await vi.advanceTimersByTimeAsync(1000);
    expect([at.now.tasksOnly, at.wire.count("setpoint")]).toEqual([true, 0]);
  });

  it("enters on while the focus moves, for no controls are awaited, but not for a page that is hidden", async () => {
    await at.leased();
    void at.session.enter(false);
    at.session.unattended("focus_lost");
    expect(at.now.phase).toBe("entering");
    at.session.unattended("page_hidden");
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
  });

  it("lets the lease end when nobody looks at the page, and gives it back with the page", async () => {
    await at.flying();
    at.present = false;
    at.session.unattended("window_blurred");
    await vi.advanceTimersByTimeAsync(12_000);
    expect([at.now.phase, at.wire.count("renew_lease")]).toEqual(["flying", 0]);
    at.session.unattended("page_closed");
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
  });

  it("is of one lease: the next vehicle may follow controls", async () => {
    await at.flying();
    at.session.releaseLease();
    at.followsControls = true;
    await at.flying();
    await vi.advanceTimersByTimeAsync(100);
    expect([at.now.tasksOnly, at.wire.count("setpoint") > 0]).toEqual([false, true]);
  });
});
