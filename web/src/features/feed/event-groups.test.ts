import * as fc from "fast-check";
import { describe, expect, it } from "vitest";
import type { StreamEvent } from "../../api/types";
import { because, type EventFields, sampleDrop, sampleEvent, sampleJob, sampleRun } from "../../testing/samples";
import { groupEvents } from "./event-groups";
import { matchesFilter } from "./filter";
import { formatEventGroup } from "./format-event-group";

const ofRun = (kind: StreamEvent["kind"], data: object = {}): EventFields => ({
  kind,
  data,
  vehicle_id: "v1",
  run_id: "r1",
});
const changed = (state: string, fields: object = {}) => ofRun("run.changed", { ...sampleRun(), state, ...fields });
const item = (item_id: string, phase = "current") => ofRun("run.item", { item_id, seq: 0, phase });
const ended = (item_id: string, took_s: number) =>
  ofRun("run.item_ended", { item_id, began_s: 10, ended_s: 10 + took_s });
const drop = (fields: object) => ofRun("run.drop", { ...sampleDrop(), ...fields });
const command = (name: string) => ofRun("run.command", { command: name, attempt: null });
const ack = (name: string) => ofRun("run.ack", { command: name, outcome: "done", detail: "" });
const fails = (name: string) => ofRun("run.ack", { command: name, outcome: "failed", detail: "no answer" });
const text = (severity: string, words: string) => ofRun("vehicle.status_text", { severity, text: words, repeated: 0 });
const mode = (name: string, in_failsafe = false) =>
  ofRun("vehicle.changed", { mode: name, armed: true, landed: "in_air", in_failsafe });
const sent = (mission_type: string, count: number) =>
  ofRun("run.upload_progress", { mission_type, sent: count, total: 4, attempt: 1, percent: 25 * count });
const stall = (delay_s: number): EventFields => ({ kind: "service.loop_stalled", data: { delay_s } });

const PREDICTED = ["takeoff", "corner", "clinic", "home"].map((item_id, i) => ({
  item_id,
  type: ["takeoff", "waypoint", "waypoint", "return_to_launch"][i],
}));

const BEGINNING: readonly EventFields[] = [
  { kind: "plan.created", data: { plan_id: "p1", name: "Clinic run" } },
  { kind: "request.accepted", data: { actor: "local", action: "create_plan", target: "/api/v1/plans" } },
  ofRun("run.created", sampleRun({ state: "created" })),
  ofRun("run.predicted", { entries: PREDICTED, duration_s: 90 }),
  changed("uploading"),
  sent("fence", 0),
  sent("fence", 4),
  sent("mission", 4),
  changed("uploaded", { reason: because("run.upload_verified") }),
  changed("starting"),
  command("DO_GRIPPER"),
  ack("DO_GRIPPER"),
  command("arm"),
  stall(0.3),
  text("info", "Armed by external command"),
  ack("arm"),
  command("start_mission"),
  mode("mission"),
  changed("flying"),
  item("takeoff"),
  changed("flying"),
];

/** What a service told of the README's delivery, in its order. */
const DELIVERY: readonly EventFields[] = [
  ...BEGINNING,
  item("takeoff", "reached"),
  ended("takeoff", 15.5),
  item("corner"),
  stall(0.8),
  item("corner", "reached"),
  ended("corner", 14.8),
  item("clinic"),
  drop({ phase: "holding" }),
  changed("at_drop"),
  drop({ phase: "releasing" }),
  ended("clinic", 20.3),
  command("DO_GRIPPER"),
  ack("DO_GRIPPER"),
  text("info", "Returning to launch"),
  drop({ phase: "done", outcome: "released", certainty: "acknowledged", reason: because("drop.acknowledged_moved") }),
  ended("drop", 2.4),
  changed("flying"),
  command("set_current"),
  mode("return"),
  item("home"),
  changed("returning"),
  changed("returning", { reason: because("run.mission_done") }),
  text("info", "RTL: land at destination"),
  ended("home", 64.2),
  changed("returning", { reason: because("run.on_ground") }),
  changed("landed"),
  changed("completed", { started_at: 1_000, ended_at: 1_118 }),
];

const events = (fields: readonly EventFields[]) => fields.map((one, i) => sampleEvent(i + 1, one)).toReversed();
const told = (fields: readonly EventFields[]) =>
  groupEvents(events(fields))
    .map((group) => formatEventGroup(group, () => "Clinic run").text)
    .toReversed();

describe("a delivery is told", () => {
  it("in a line for its upload, its start, each item, its drop and its end", () => {
    expect(told(DELIVERY)).toEqual([
      "“Clinic run” was uploaded to v1.",
      "Create plan, requested by local.",
      "v1 started “Clinic run”.",
      "Waydrop was blocked 2 times for up to 0.8 s.",
      "v1 took off in 16 s.",
      "v1 reached “corner” in 15 s.",
      "v1 reached “clinic” in 20 s.",
      "v1 released “drop”: acknowledged, and the output moved.",
      "v1 returned to launch in 1 min 04 s.",
      "v1 completed “Clinic run” in 1 min 58 s.",
    ]);
  });

  it("while it happens: the newest line says how far it is", () => {
    const newest = (count: number) => told(DELIVERY.slice(0, count)).at(-1);
    expect([1, 3, 6, 9, 10, 20, 22].map(newest)).toEqual([
      "Plan “Clinic run” was stored.",
      "Create plan, requested by local.",
      "Create plan, requested by local.",
      "Create plan, requested by local.",
      "v1 is starting “Clinic run”.",
      "v1 is taking off.",
      "v1 took off.",
    ]);
    expect(told(DELIVERY.slice(0, 6))[0]).toBe("v1: uploading the fence: 0 of 4.");
    expect(told(DELIVERY.slice(0, 29)).at(-1)).toBe("v1: drop “drop”: holding.");
  });

  it("with a line of its own for each pause, what interrupts it, and what the vehicle warns of", () => {
    const lines = told([
      ...BEGINNING,
      command("pause"),
      mode("hold"),
      ack("pause"),
      changed("paused", { reason: because("run.paused_as_asked") }),
      command("resume"),
      changed("flying"),
      item("takeoff", "reached"),
      item("corner"),
      command("pause"),
      changed("paused", { reason: because("run.paused_as_asked") }),
      text("warning", "Low battery"),
      mode("return", true),
      changed("returning", { reason: because("run.failsafe") }),
    ]);
    expect(lines.slice(4)).toEqual([
      "v1 took off.",
      "“Clinic run” on v1: paused by command.",
      "v1 resumed “Clinic run” after 2 s.",
      "v1 is flying to “corner”.",
      "“Clinic run” on v1: paused by command.",
      "v1: “Low battery”",
      "v1 is in failsafe, mode Return.",
      "“Clinic run” on v1: returning. A failsafe is active.",
    ]);
  });

  it("with each command that fails, after which the flight goes on as before", () => {
    const all = groupEvents(
      events([
        ...BEGINNING,
        item("corner"),
        changed("flying", { commanded: "return" }),
        command("return"),
        changed("flying"),
        fails("return"),
        changed("flying", { commanded: "return" }),
        command("return"),
        changed("flying"),
        fails("return"),
        item("corner", "reached"),
        changed("flying"),
      ]),
    ).toReversed();
    const lines = all.map((group) => formatEventGroup(group)).slice(-3);
    expect(lines.map(({ text }) => text)).toEqual([
      "v1 reached “corner”.",
      "v1: RETURN: failed: no answer.",
      "v1: RETURN: failed: no answer.",
    ]);
    expect(lines.map(({ tone }) => tone)).toEqual(["ok", "danger", "danger"]);
    expect(all.slice(-2).map((group) => matchesFilter(group, "problems", { vehicle: null, run: null }))).toEqual([
      true,
      true,
    ]);
  });

  it("with a pause as long as it was, whatever else is commanded before and after it", () => {
    const asked = because("run.paused_as_asked");
    const steps: readonly (readonly [number, EventFields])[] = [
      [0, item("corner")],
      [10, command("pause")],
      [10, ack("pause")],
      [10, changed("paused", { reason: asked })],
      [11, changed("paused", { reason: asked, commanded: "return" })],
      [11, command("return")],
      [12, changed("paused", { reason: asked })],
      [12, fails("return")],
      [14, changed("paused", { reason: asked, commanded: "resume" })],
      [14, command("resume")],
      [14, changed("paused", { reason: because("run.resuming_as_asked") })],
      [14, changed("flying")],
      [14, ack("resume")],
      [21, changed("flying", { commanded: "return" })],
      [21, command("return")],
      [24, changed("flying")],
      [24, fails("return")],
    ];
    const groups = groupEvents(events(steps.map(([time, fields]) => ({ ...fields, time })))).toReversed();
    expect(groups.map((group) => [group.head.time, formatEventGroup(group, () => "Clinic run").text])).toEqual([
      [0, "v1 is at “corner”."],
      [10, "“Clinic run” on v1: paused by command."],
      [12, "v1: RETURN: failed: no answer."],
      [14, "v1 resumed “Clinic run” after 4 s."],
      [24, "v1: RETURN: failed: no answer."],
    ]);
  });

  it("and an item that is flown to again is told again", () => {
    const lines = told([...BEGINNING, item("corner"), item("clinic"), item("corner"), item("corner", "reached")]);
    expect(lines.slice(-3)).toEqual(["v1 is flying to “corner”.", "v1 is flying to “clinic”.", "v1 reached “corner”."]);
  });

  it("and where its upload fails, that line says so", () => {
    const failed = changed("failed", { reason: because("error", { error: "link", detail: "no answer" }) });
    expect(told([...BEGINNING.slice(0, 6), failed])[0]).toBe("“Clinic run” on v1: failed. No answer.");
  });
});

describe("a group", () => {
  const ofVehicle = (kind: StreamEvent["kind"], data: object = {}, time = 0): EventFields => ({
    kind,
    data,
    vehicle_id: "v1",
    time,
  });

  it("of a lost link lasts until it is restored, and the next loss is another", () => {
    expect(
      told([
        ofVehicle("vehicle.link_lost", {}, 0),
        ofVehicle("vehicle.link_restored", {}, 400),
        ofVehicle("vehicle.link_lost", {}, 410),
      ]),
    ).toEqual(["v1: link restored after 6 min 40 s.", "v1: link lost."]);
  });

  it("of a vehicle alone ends with a lull", () => {
    const armed = (time: number) =>
      ofVehicle("vehicle.changed", { mode: "hold", armed: true, landed: "on_ground", in_failsafe: false }, time);
    const seen = ofVehicle("vehicle.seen", { vehicle_type: "rover", firmware: "1.17.0" }, 0);
    expect(told([seen, armed(1), armed(4_000), armed(4_001)])).toEqual([
      "v1 connected: rover, firmware 1.17.0.",
      "v1: Hold mode, armed, on ground.",
    ]);
  });

  it("of a job lasts until its end", () => {
    const job = (change: string, time: number): EventFields => ({
      kind: "job.changed",
      data: { change, actor: "desk", job: sampleJob({ state: "completed" }) },
      vehicle_id: "v1",
      time,
    });
    expect(told([job("queued", 0), job("assigned", 900), job("started", 950), job("ended", 9_000)])).toEqual([
      "Job “Clinic run” completed.",
    ]);
  });
});

describe("manual control", () => {
  const control = (kind: "offboard.lease" | "task.changed", data: object, time: number): EventFields =>
    ({ kind, vehicle_id: "v1", data: { reason: null, other: null, insert_mode: null, ...data }, time }) as EventFields;

  it("that ends is one line with the tasks that it discards", () => {
    const reason = because("offboard.socket_closed");
    expect(
      told([
        control("offboard.lease", { change: "acquired", holder: "ann" }, 0),
        control("task.changed", { change: "inserted", task_id: "t1", insert_mode: "append" }, 20),
        control("task.changed", { change: "dropped", task_id: "t1", reason }, 40),
        control("offboard.lease", { change: "revoked", holder: "ann", reason }, 40),
      ]),
    ).toEqual(["ann lost the lease of v1: the client disconnected.", "v1: task t1 was queued at the end."]);
  });
});

describe("whatever happens", () => {
  const strings = fc.constantFrom("a", "b");
  const anyEvent: fc.Arbitrary<EventFields> = fc.oneof(
    fc.constantFrom(...DELIVERY),
    fc
      .record({ item_id: strings, phase: fc.constantFrom("current", "reached") })
      .map((data) => ofRun("run.item", data)),
    fc.constantFrom("arm", "pause", "resume", "return", "hold", "change_mission").map(command),
    fc.constantFrom("arm", "pause", "resume", "return", "change_mission").map(fails),
    fc
      .constantFrom("uploading", "flying", "paused", "returning", "at_drop", "failed", "landed")
      .map((state) => changed(state)),
    fc.constantFrom<EventFields>(
      { kind: "vehicle.link_lost", vehicle_id: "v1" },
      { kind: "vehicle.link_restored", vehicle_id: "v1" },
      { kind: "offboard.lease", vehicle_id: "v1", data: { change: "acquired", holder: "ann" } },
      { kind: "offboard.lease", vehicle_id: "v1", data: { change: "released", holder: "ann" } },
      { kind: "later.kind" as "service.started" },
    ),
  );
  const feeds = fc
    .array(fc.tuple(anyEvent, fc.integer({ min: 0, max: 9_000 })), { maxLength: 60 })
    .map((steps) => steps.map(([fields, time], i) => sampleEvent(i + 1, { ...fields, time })).toReversed());
  const seqs = (of: readonly StreamEvent[]) => of.map(({ seq }) => seq);

  it("each event is in one group, and both are in order", () => {
    fc.assert(
      fc.property(feeds, (feed) => {
        const groups = groupEvents(feed);
        expect(seqs(groups.flatMap((group) => group.events)).sort((a, b) => b - a)).toEqual(seqs(feed));
        for (const { events: of, head } of groups) {
          expect(seqs(of)).toEqual(seqs(of).toSorted((a, b) => b - a));
          expect(of).toContain(head);
        }
        const first = groups.map(({ events: of }) => of.at(-1)?.seq ?? 0);
        expect(first).toEqual(first.toSorted((a, b) => b - a));
        expect(new Set(groups.map(({ key }) => key)).size).toBe(groups.length);
      }),
    );
  });

  it("a new event begins a group or makes one grow, and no line moves", () => {
    fc.assert(
      fc.property(feeds, (feed) => {
        const [before, after] = [groupEvents(feed.slice(1)), groupEvents(feed)];
        expect(after.slice(after.length - before.length).map(({ key }) => key)).toEqual(before.map(({ key }) => key));
        expect(after.length - before.length).toBeLessThanOrEqual(1);
      }),
    );
  });
});
