import { describe, expect, it, vi } from "vitest";
import type { ClientFrame, Offboard, ServerAnswer, TaskQueue, TaskState } from "../../api/types";
import { because } from "../../testing/samples";
import { ActivityMonitor } from "./activity";
import type { StopReason } from "./sender";
import type { Setpoint } from "./setpoint";
import { DONE, FakeWire, REFUSED } from "./testing/fake-socket";
import { eachWithFixture, SessionFixture } from "./testing/session-fixture";

let at: SessionFixture;
let ON: Setpoint;
/** What the controls ask for. */
let asked: Setpoint | StopReason;
eachWithFixture(
  () => new SessionFixture("v1", "multicopter", true, () => asked),
  (bench) => {
    at = bench;
    asked = ON = { ...bench.still, forward_m_s: 1.5 } as Setpoint;
  },
);

describe("a session", () => {
  it("takes the lease, and sends no setpoint for it", async () => {
    await at.leased();
    await vi.advanceTimersByTimeAsync(7000);
    expect([at.now.phase, at.wire.count("setpoint"), at.wire.count("renew_lease")]).toEqual(["leased", 0, 2]);
  });

  it("tells why the lease is refused, closes, and asks no more", async () => {
    at.session.acquireLease("v1");
    at.wire.events.onOpen();
    await at.wire.answer(REFUSED);
    expect(at.now).toMatchObject({
      phase: "off",
      refusal: { action: "Take the lease of v1", code: "offboard.lease_held", detail: "ben has it", hint: "wait" },
    });
    await vi.advanceTimersByTimeAsync(60_000);
    expect([at.wire.closed, FakeWire.all.length]).toEqual([true, 1]);
  });

  it("keeps the lease only while somebody looks at the page", async () => {
    await at.leased();
    at.present = false;
    await vi.advanceTimersByTimeAsync(20_000);
    expect(at.wire.count("renew_lease")).toBe(0);
  });

  it("sends setpoints from the entry on, with controls that start fresh", async () => {
    await at.leased();
    void at.session.enter(true);
    await vi.advanceTimersByTimeAsync(1000);
    expect([at.now.phase, at.fresh, at.wire.count("setpoint")]).toEqual(["entering", 1, 21]);
    expect(at.wire.frames).toContainEqual({ type: "enter", sticks_held: true });
    await at.wire.answer(DONE);
    expect(at.now.phase).toBe("flying");
  });

  it("stays silent after a refused entry and keeps the lease", async () => {
    await at.leased();
    void at.session.enter(false);
    await at.wire.answer({ ...REFUSED, code: "offboard.audit_failed" });
    const before = at.wire.count("setpoint");
    await vi.advanceTimersByTimeAsync(4000);
    expect([
      at.now.phase,
      at.now.refusal?.code,
      at.wire.count("setpoint") - before,
      at.wire.count("renew_lease"),
    ]).toEqual(["leased", "offboard.audit_failed", 0, 1]);
  });

  it.each(["page_hidden", "window_blurred", "focus_lost", "no_input"] as const)(
    "falls silent for good when nobody is there (%s): the dead-man does the rest",
    async (reason) => {
      await at.flying();
      at.session.unattended(reason);
      const before = at.wire.count("setpoint");
      asked = ON;
      await vi.advanceTimersByTimeAsync(900);
      expect([at.now.phase, at.now.fellSilent, at.wire.count("setpoint") - before]).toEqual(["silent", true, 0]);
      at.wire.events.onState({
        state: "idle",
        lease: null,
        reason: because("offboard.client_silent", { silent_s: 1 }),
        sent: null,
        rate: null,
      } as Offboard);
      at.wire.events.onClosed(4410, "the lease has ended");
      expect(at.now.phase).toBe("off");
      expect(at.now.ended).toMatch(/\w+\. The client was silent for 1\.0 s\.$/);
      await vi.advanceTimersByTimeAsync(60_000);
      expect(FakeWire.all.length).toBe(1);
    },
  );

  it("notices at the next moment that nobody is there, even if no event told it", async () => {
    await at.flying();
    asked = "focus_lost";
    await vi.advanceTimersByTimeAsync(60);
    expect(at.now.phase).toBe("silent");
  });

  it("falls silent a minute after the last touch, with the page visible and in focus all the time", async () => {
    await at.flying();
    const presence = new ActivityMonitor();
    presence.touch(Date.now());
    at.nextSetpoint = () => (presence.at(Date.now()) === "inactive" ? "no_input" : ON);
    await vi.advanceTimersByTimeAsync(50_000);
    presence.key({ repeat: false }, Date.now());
    await vi.advanceTimersByTimeAsync(59_900);
    expect(at.now.phase).toBe("flying");
    await vi.advanceTimersByTimeAsync(200);
    expect([at.now.phase, at.now.ended]).toEqual(["silent", "There was no input for a minute."]);
  });

  it("breaks an entry off when nobody is there, so that no mode is entered in which nobody flies", async () => {
    await at.leased();
    void at.session.enter(false);
    at.session.unattended("page_hidden");
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
    await at.wire.answer(DONE);
    expect([at.now.phase, at.wire.count("setpoint")]).toEqual(["off", 1]);
  });

  it("closes at once with the page", async () => {
    await at.flying();
    at.session.unattended("page_closed");
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
  });

  it("gives up a silent socket of which nothing is heard", async () => {
    await at.flying();
    at.session.unattended("window_blurred");
    await vi.advanceTimersByTimeAsync(3100);
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
    expect(at.now.ended).toContain("failsafe");
  });

  it("never opens again by itself after a loss, and flies again only with a new lease and a new entry", async () => {
    await at.flying();
    at.wire.events.onClosed(1006, "");
    expect([at.now.phase, at.now.ended]).toEqual(["off", "The connection was lost."]);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(FakeWire.all.length).toBe(1);
    await at.leased();
    await vi.advanceTimersByTimeAsync(2000);
    expect([FakeWire.all.length, at.now.phase, at.wire.count("setpoint")]).toEqual([2, "leased", 0]);
  });

  it("holds one lease at a time", async () => {
    await at.leased();
    at.session.acquireLease("v2");
    expect([FakeWire.all.length, at.now.vehicle]).toEqual([1, "v1"]);
  });

  it("stands still while it leaves, and goes on flying if that is refused", async () => {
    await at.flying();
    void at.session.leave("mission");
    await vi.advanceTimersByTimeAsync(60);
    expect(at.wire.frames.at(-1)).toEqual({ type: "setpoint", setpoint: at.still });
    await at.wire.answer({ ...REFUSED, code: "state.conflict" });
    expect([at.now.phase, at.now.refusal?.code]).toEqual(["flying", "state.conflict"]);
    void at.session.leave("hold");
    await at.wire.answer({ ...DONE, command: "leave" });
    const before = at.wire.count("setpoint");
    await vi.advanceTimersByTimeAsync(500);
    expect([at.now.phase, at.now.fellSilent, at.wire.closed, at.wire.count("setpoint") - before]).toEqual([
      "off",
      false,
      true,
      0,
    ]);
  });

  it("lets go of all controls when a setpoint is refused: the same again would count as silence", async () => {
    await at.flying();
    const before = at.fresh;
    at.wire.events.onAnswer({ ...REFUSED, id: 3, code: "limit.fence" });
    expect([at.fresh - before, at.now.refusal?.action, at.now.phase]).toEqual([1, "Setpoint", "flying"]);
  });

  it("ignores a socket that it has given up", async () => {
    await at.flying();
    const old = at.wire;
    at.session.releaseLease();
    at.session.acquireLease("v1");
    old.events.onClosed(4410, "");
    old.events.onAnswer(REFUSED);
    expect([at.now.phase, at.now.refusal]).toEqual(["opening", null]);
  });
});

describe("a session with tasks", () => {
  const TASK = { type: "task", task: { type: "goto" }, insert: "append", when_empty: "wait" } as Extract<
    ClientFrame,
    { type: "task" }
  >;
  const RESUME = { type: "queue", action: "resume" } as const;
  const QUEUED: ServerAnswer = { type: "queued", id: 1, task_id: "t1" };
  const tell = (state: TaskState) => at.wire.events.onTasks({ report: { state }, tasks: [] } as unknown as TaskQueue);
  const sentIn = async (ms: number) => {
    const before = [at.wire.count("setpoint"), at.wire.count("renew_lease")];
    await vi.advanceTimersByTimeAsync(ms);
    return [at.wire.count("setpoint") - (before[0] ?? 0), at.wire.count("renew_lease") - (before[1] ?? 0)];
  };

  async function flown(): Promise<void> {
    await at.flying();
    void at.session.queue("Add", TASK);
    await at.wire.answer(QUEUED);
    tell("flying");
  }

  it("says no setpoint of its own while they are flown, and keeps the lease", async () => {
    await at.flying();
    const before = at.fresh;
    void at.session.queue("Add", TASK);
    expect([at.now.source, at.wire.frames.at(-1)?.type, at.fresh - before]).toEqual(["tasks", "task", 1]);
    expect(await sentIn(7000)).toEqual([0, 2]);
  });

  it("enters with a queue that waits, and says nothing over it", async () => {
    await at.leased();
    void at.session.queue("Add", TASK);
    await at.wire.answer(QUEUED);
    tell("waiting");
    void at.session.enter(false);
    await at.wire.answer(DONE);
    expect([at.now.phase, at.now.source, at.wire.count("setpoint")]).toEqual(["flying", "tasks", 0]);
  });

  it("has the controls lead again as soon as they move, until the queue is asked to go on", async () => {
    await flown();
    at.session.switchToControls();
    expect((await sentIn(1000))[0]).toBe(20);
    tell("manual");
    void at.session.queue("Add", TASK); // behind the others: it waits with them
    expect(at.now.source).toBe("controls");
    await at.wire.answer(QUEUED);
    void at.session.queue("Go on", RESUME);
    tell("manual"); // from before
    expect(at.now.source).toBe("tasks");
    await at.wire.answer({ ...DONE, command: "queue" });
    tell("flying");
    expect(await sentIn(1000)).toEqual([0, 0]);
  });

  it("sends setpoints again when the first task is refused, and tells why", async () => {
    await at.flying();
    const answer = at.session.queue("Add", TASK);
    await at.wire.answer({ ...REFUSED, code: "limit.fence" });
    expect([await answer, at.now.source]).toMatchObject([{ action: "Add", code: "limit.fence" }, "controls"]);
    expect((await sentIn(1000))[0]).toBe(20);
  });

  it("never says that a thing is done which was not sent, or not answered before control ended", async () => {
    await flown();
    const lost = at.session.queue("Add", TASK); // a socket that ends answers no more
    at.session.releaseLease();
    expect(await lost).toMatchObject({
      action: "Add",
      code: "control.ended",
      detail: "control ended before an answer came",
    });
    const sent = at.wire.frames.length;
    expect(await at.session.queue("Add", TASK)).toMatchObject({
      action: "Add",
      detail: "control has ended, so nothing was sent",
    });
    await at.flying();
    at.session.unattended("page_hidden"); // silent: the socket is there, and nothing is sent any more
    expect([at.now.phase, await at.session.queue("Go on", RESUME)]).toMatchObject([
      "silent",
      { code: "control.ended" },
    ]);
    expect([FakeWire.all[0]?.frames.length, at.wire.count("queue")]).toEqual([sent, 0]);
  });

  it("goes on while somebody looks elsewhere on the page, and lets the lease end when nobody looks at it", async () => {
    await flown();
    at.session.unattended("focus_lost");
    expect(at.now.phase).toBe("flying");
    at.present = false;
    at.session.unattended("page_hidden");
    expect([at.now.phase, await sentIn(12_000)]).toEqual(["flying", [0, 0]]);
    at.session.unattended("page_closed");
    expect([at.now.phase, at.wire.closed]).toEqual(["off", true]);
  });
});
