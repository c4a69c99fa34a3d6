import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { Offboard, TaskQueue, TaskState } from "../api/types";
import type { Answer, ClientFrame } from "./frames";
import { Presence } from "./presence";
import type { StopReason } from "./sender";
import { HANDS_OFF, Session, type HandsOn } from "./session";
import { neutral, speedsOf, type Setpoint } from "./setpoint";
import { DONE, FakeWire, GRANTED, REFUSED } from "../testing/fake-wire";

const STILL = neutral(speedsOf("slow", null), "multicopter");
const ON: Setpoint = { ...STILL, forward_m_s: 1.5 };

let now: HandsOn;
let asked: Setpoint | StopReason;
let ask: () => Setpoint | StopReason;
let present: boolean;
let followsHands: boolean;
let fresh: number;
let session: Session;

const wire = () => FakeWire.all.at(-1) as FakeWire;

async function leased(): Promise<void> {
  session.take("v1");
  wire().events.onOpen();
  await wire().answer(GRANTED);
}

async function flying(): Promise<void> {
  await leased();
  void session.enter(false);
  await wire().answer(DONE);
}

beforeEach(() => {
  vi.useFakeTimers();
  FakeWire.all = [];
  [now, asked, present, fresh, followsHands] = [HANDS_OFF, ON, true, 0, true];
  ask = () => asked;
  session = new Session({
    connect: (_, events) => new FakeWire(events),
    now: () => Date.now(),
    followsHands: () => followsHands,
    ask: () => ask(),
    neutral: () => STILL,
    isPresent: () => present,
    onFreshHands: () => (fresh += 1),
    onChange: (next) => (now = next),
  });
});

afterEach(() => {
  session.giveBack();
  vi.useRealTimers();
});

describe("a session", () => {
  it("takes the lease, and sends no setpoint for it", async () => {
    await leased();
    await vi.advanceTimersByTimeAsync(7000);
    expect([now.phase, wire().count("setpoint"), wire().count("renew")]).toEqual(["leased", 0, 2]);
  });

  it("tells why the lease is refused, closes, and asks no more", async () => {
    session.take("v1");
    wire().events.onOpen();
    await wire().answer(REFUSED);
    expect(now).toMatchObject({ phase: "off", refusal: { doing: "Take the lease of v1", code: "offboard.lease_held", detail: "ben has it", hint: "wait" } });
    await vi.advanceTimersByTimeAsync(60_000);
    expect([wire().closed, FakeWire.all.length]).toEqual([true, 1]);
  });

  it("keeps the lease only while somebody looks at the page", async () => {
    await leased();
    present = false;
    await vi.advanceTimersByTimeAsync(20_000);
    expect(wire().count("renew")).toBe(0);
  });

  it("speaks from the entry on, with hands that start fresh", async () => {
    await leased();
    void session.enter(true);
    await vi.advanceTimersByTimeAsync(1000);
    expect([now.phase, fresh, wire().count("setpoint")]).toEqual(["entering", 1, 21]);
    expect(wire().frames).toContainEqual({ type: "enter", sticks_held: true });
    await wire().answer(DONE);
    expect(now.phase).toBe("flying");
  });

  it("stays silent after a refused entry and keeps the lease", async () => {
    await leased();
    void session.enter(false);
    await wire().answer({ ...REFUSED, code: "offboard.audit_failed" });
    const before = wire().count("setpoint");
    await vi.advanceTimersByTimeAsync(4000);
    expect([now.phase, now.refusal?.code, wire().count("setpoint") - before, wire().count("renew")]).toEqual(["leased", "offboard.audit_failed", 0, 1]);
  });

  it.each(["hidden", "window_left", "focus_left", "nobody"] as const)("falls silent for good when nobody is there (%s): the dead-man does the rest", async (reason) => {
    await flying();
    session.unattended(reason);
    const before = wire().count("setpoint");
    asked = ON;
    await vi.advanceTimersByTimeAsync(900);
    expect([now.phase, now.fellSilent, wire().count("setpoint") - before]).toEqual(["silent", true, 0]);
    wire().events.onState({ state: "idle", lease: null, reason: "the client was silent for 1.0 s", sent: null, cadence: null } as Offboard);
    wire().events.onClosed(4410, "the lease has ended");
    expect(now.phase).toBe("off");
    expect(now.ended).toMatch(/\w+\. The client was silent for 1\.0 s\.$/);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(FakeWire.all.length).toBe(1);
  });

  it("notices at the next moment that nobody is there, even if no event told it", async () => {
    await flying();
    asked = "focus_left";
    await vi.advanceTimersByTimeAsync(60);
    expect(now.phase).toBe("silent");
  });

  it("falls silent a minute after the last touch, with the page visible and in focus all the time", async () => {
    await flying();
    const presence = new Presence();
    presence.touch(Date.now());
    ask = () => (presence.at(Date.now()) === "nobody" ? "nobody" : ON);
    await vi.advanceTimersByTimeAsync(50_000);
    presence.key({ repeat: false }, Date.now());
    await vi.advanceTimersByTimeAsync(59_900);
    expect(now.phase).toBe("flying");
    await vi.advanceTimersByTimeAsync(200);
    expect([now.phase, now.ended]).toEqual(["silent", "Nobody touched a control for a minute."]);
  });

  it("breaks an entry off when nobody is there, so that no mode is entered in which nobody flies", async () => {
    await leased();
    void session.enter(false);
    session.unattended("hidden");
    expect([now.phase, wire().closed]).toEqual(["off", true]);
    await wire().answer(DONE);
    expect([now.phase, wire().count("setpoint")]).toEqual(["off", 1]);
  });

  it("closes at once with the page", async () => {
    await flying();
    session.unattended("page_closed");
    expect([now.phase, wire().closed]).toEqual(["off", true]);
  });

  it("gives up a silent socket of which nothing is heard", async () => {
    await flying();
    session.unattended("window_left");
    await vi.advanceTimersByTimeAsync(3100);
    expect([now.phase, wire().closed]).toEqual(["off", true]);
    expect(now.ended).toContain("failsafe");
  });

  it("never opens again by itself after a loss, and flies again only with a new lease and a new entry", async () => {
    await flying();
    wire().events.onClosed(1006, "");
    expect([now.phase, now.ended]).toEqual(["off", "The connection was lost."]);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(FakeWire.all.length).toBe(1);
    await leased();
    await vi.advanceTimersByTimeAsync(2000);
    expect([FakeWire.all.length, now.phase, wire().count("setpoint")]).toEqual([2, "leased", 0]);
  });

  it("holds one lease at a time", async () => {
    await leased();
    session.take("v2");
    expect([FakeWire.all.length, now.vehicle]).toEqual([1, "v1"]);
  });

  it("stands still while it leaves, and goes on flying if that is refused", async () => {
    await flying();
    void session.leave("mission");
    await vi.advanceTimersByTimeAsync(60);
    expect(wire().frames.at(-1)).toEqual({ type: "setpoint", setpoint: STILL });
    await wire().answer({ ...REFUSED, code: "conflict" });
    expect([now.phase, now.refusal?.code]).toEqual(["flying", "conflict"]);
    void session.leave("hold");
    await wire().answer({ ...DONE, what: "leave" });
    const before = wire().count("setpoint");
    await vi.advanceTimersByTimeAsync(500);
    expect([now.phase, now.fellSilent, wire().closed, wire().count("setpoint") - before]).toEqual(["off", false, true, 0]);
  });

  it("lets go of all controls when a setpoint is refused: the same again would count as silence", async () => {
    await flying();
    const before = fresh;
    wire().events.onAnswer({ ...REFUSED, id: 3, code: "limit.fence" });
    expect([fresh - before, now.refusal?.doing, now.phase]).toEqual([1, "Setpoint", "flying"]);
  });

  it("ignores a socket that it has given up", async () => {
    await flying();
    const old = wire();
    session.giveBack();
    session.take("v1");
    old.events.onClosed(4410, "");
    old.events.onAnswer(REFUSED);
    expect([now.phase, now.refusal]).toEqual(["opening", null]);
  });
});

describe("a session with tasks", () => {
  const TASK = { type: "task", task: { type: "goto" }, insert: "append", when_empty: "wait" } as Extract<ClientFrame, { type: "task" }>;
  const RESUME = { type: "queue", do: "resume" } as const;
  const QUEUED: Answer = { type: "queued", id: 1, task_id: "t1" };
  const tell = (state: TaskState) => wire().events.onTasks({ report: { state }, tasks: [] } as unknown as TaskQueue);
  const sentIn = async (ms: number) => {
    const before = [wire().count("setpoint"), wire().count("renew")];
    await vi.advanceTimersByTimeAsync(ms);
    return [wire().count("setpoint") - (before[0] ?? 0), wire().count("renew") - (before[1] ?? 0)];
  };

  async function flown(): Promise<void> {
    await flying();
    void session.queue("Add", TASK);
    await wire().answer(QUEUED);
    tell("flying");
  }

  it("says no setpoint of its own while they are flown, and keeps the lease", async () => {
    await flying();
    const before = fresh;
    void session.queue("Add", TASK);
    expect([now.leads, wire().frames.at(-1)?.type, fresh - before]).toEqual(["tasks", "task", 1]);
    expect(await sentIn(7000)).toEqual([0, 2]);
  });

  it("enters with a queue that waits, and says nothing over it", async () => {
    await leased();
    void session.queue("Add", TASK);
    await wire().answer(QUEUED);
    tell("waiting");
    void session.enter(false);
    await wire().answer(DONE);
    expect([now.phase, now.leads, wire().count("setpoint")]).toEqual(["flying", "tasks", 0]);
  });

  it("has the hands lead again as soon as they move, until the queue is asked to go on", async () => {
    await flown();
    session.takeOver();
    expect((await sentIn(1000))[0]).toBe(20);
    tell("by_hand");
    void session.queue("Add", TASK); // behind the others: it waits with them
    expect(now.leads).toBe("hands");
    await wire().answer(QUEUED);
    void session.queue("Go on", RESUME);
    tell("by_hand"); // from before
    expect(now.leads).toBe("tasks");
    await wire().answer({ ...DONE, what: "queue" });
    tell("flying");
    expect(await sentIn(1000)).toEqual([0, 0]);
  });

  it("speaks again when the first task is refused, and tells why", async () => {
    await flying();
    const answer = session.queue("Add", TASK);
    await wire().answer({ ...REFUSED, code: "limit.fence" });
    expect([await answer, now.leads]).toMatchObject([{ doing: "Add", code: "limit.fence" }, "hands"]);
    expect((await sentIn(1000))[0]).toBe(20);
  });

  it("never says that a thing is done which was not sent, or not answered before control ended", async () => {
    await flown();
    const lost = session.queue("Add", TASK); // a socket that ends answers no more
    session.giveBack();
    expect(await lost).toMatchObject({ doing: "Add", code: "control.ended", detail: expect.stringContaining("not answered") });
    const sent = wire().frames.length;
    expect(await session.queue("Add", TASK)).toMatchObject({ doing: "Add", detail: "not sent: control has ended" });
    await flying();
    session.unattended("hidden"); // silent: the socket is there, and nothing is sent any more
    expect([now.phase, await session.queue("Go on", RESUME)]).toMatchObject(["silent", { code: "control.ended" }]);
    expect([FakeWire.all[0]?.frames.length, wire().count("queue")]).toEqual([sent, 0]);
  });

  it("goes on while somebody looks elsewhere on the page, and lets the lease end when nobody looks at it", async () => {
    await flown();
    session.unattended("focus_left");
    expect(now.phase).toBe("flying");
    present = false;
    session.unattended("hidden");
    expect([now.phase, await sentIn(12_000)]).toEqual(["flying", [0, 0]]);
    session.unattended("page_closed");
    expect([now.phase, wire().closed]).toEqual(["off", true]);
  });
});
