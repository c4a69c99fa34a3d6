import { describe, expect, it } from "vitest";
import type { EventKind } from "../../api/types";
import { because, type EventFields, sampleDrop, sampleEvent, sampleRun } from "../../testing/samples";
import { sentence } from "./format-event";

describe("sentences", () => {
  const say = (kind: EventKind, data: object, fields: EventFields = {}) =>
    sentence(sampleEvent(1, { kind, data, vehicle_id: "v1", run_id: "r1", ...fields }));

  it("say what happened to which vehicle", () => {
    expect(say("vehicle.link_lost", {}).text).toBe("The link to v1 is lost.");
    expect(say("vehicle.changed", { mode: "mission", armed: true, landed: "in_air", in_failsafe: false }).text).toBe(
      "v1: mission mode, armed, in air.",
    );
    expect(say("vehicle.changed", { mode: "return", in_failsafe: true })).toEqual({
      text: "v1 is in failsafe, mode return.",
      tone: "danger",
    });
    expect(say("vehicle.parameters", { parameters: { NAV_ACC_RAD: 3.5, PD_GRIPPER_TYPE: -1 } }).text).toBe(
      "Parameters of v1 were changed: NAV_ACC_RAD 3.5, PD_GRIPPER_TYPE -1.",
    );
    expect(say("run.plan_refused", { code: "plan.rejected", findings: [] }).text).toBe(
      "Run r1 was not started: v1, as it is set now, would not fly its plan.",
    );
    expect(say("run.upload_progress", { mission_type: "fence", sent: 2, total: 4 }).text).toBe(
      "Uploading the fence to v1: 2 of 4.",
    );
    expect(
      say("run.changed", {
        ...sampleRun({ state: "failed", reason: because("error", { error: "link", detail: "no answer" }) }),
      }),
    ).toEqual({ text: "Run r1 of v1: failed. No answer.", tone: "danger" });
    expect(
      say("run.changed", { ...sampleRun({ state: "uploaded", reason: because("run.upload_verified") }) }).text,
    ).toBe("Run r1 of v1: ready to start. The vehicle reports the ID of the uploaded mission.");
    expect(say("run.changed", { ...sampleRun({ state: "paused", reason: because("run.resuming_as_asked") }) })).toEqual(
      { text: "Run r1 of v1 is told to go on.", tone: "info" },
    );
    expect(say("run.changed", { ...sampleRun({ state: "paused", reason: because("run.paused_as_asked") }) }).tone).toBe(
      "warn",
    );
    expect(say("run.changed", { ...sampleRun({ state: "returning", reason: because("run.on_ground") }) }).tone).toBe(
      "info",
    );
    expect(say("run.changed", { ...sampleRun({ state: "returning", reason: because("run.failsafe") }) }).tone).toBe(
      "warn",
    );
  });

  it("name a run by its plan, and by its id where the plan is not known", () => {
    const event = (kind: EventKind, plan_id: string) =>
      sampleEvent(1, {
        kind,
        data: { ...sampleRun({ state: "flying" }), plan_id, continued_by: "r2" },
        vehicle_id: "v1",
        run_id: "r1",
      });
    const name = (plan_id: string) => (plan_id === "p1" ? "Clinic run" : null);
    expect(sentence(event("run.changed", "p1"), name).text).toBe("“Clinic run” of v1: flying.");
    expect(sentence(event("run.created", "p1"), name).text).toBe("“Clinic run” was created for v1.");
    expect(sentence(event("run.changed", "p2"), name).text).toBe("Run r1 of v1: flying.");
    expect(sentence(event("run.continued", "p2"), name).text).toBe("What was left of run r1 of v1 is flown by run r2.");
  });

  it("keep what was sent apart from what was answered", () => {
    expect(say("run.command", { command: "DO_GRIPPER", attempt: 2 }).text).toBe("Sent DO_GRIPPER to v1 (try 2).");
    expect(say("run.ack", { command: "DO_GRIPPER", outcome: "acknowledged", result: "ACCEPTED", progress: 0 })).toEqual(
      { text: "v1 answered DO_GRIPPER: accepted.", tone: "ok" },
    );
    expect(
      say("run.ack", { command: "DO_GRIPPER", outcome: "acknowledged", result: "DENIED", progress: null }).tone,
    ).toBe("danger");
    expect(say("run.ack", { command: "DO_GRIPPER", outcome: "not_sent", detail: "too late" })).toEqual({
      text: "DO_GRIPPER, v1: not sent: too late.",
      tone: "danger",
    });
    expect(say("run.ack", { command: "arm", outcome: "done", detail: "" })).toEqual({
      text: "ARM, v1: done.",
      tone: "ok",
    });
  });

  it("claim no more of a drop than is known", () => {
    const alone = say("run.drop", {
      ...sampleDrop({ outcome: "released", certainty: "acknowledged", output_evidence: "not_assigned" }),
    });
    expect(alone).toEqual({ text: "v1 acknowledged the release of “drop”; no output was seen to move.", tone: "warn" });
    expect(say("run.drop", { ...sampleDrop({ outcome: "released", certainty: "acknowledged" }) }).text).toBe(
      "v1 released “drop”, acknowledged by the vehicle.",
    );
    expect(say("drop.consent_asked", { plan_item_id: "drop" }).text).toBe(
      "v1 holds at “drop” and waits for an operator's consent.",
    );
    expect(
      say("drop.consent_closed", {
        plan_item_id: "drop",
        state: "granted",
        actor: "anna",
        comment: "gate is closed",
        reason: null,
      }).text,
    ).toBe("“drop”: Consent granted by anna: gate is closed.");
    expect(
      say("drop.consent_closed", { plan_item_id: "drop", state: "timed_out", actor: null, comment: "", reason: null }),
    ).toEqual({ text: "“drop”: No consent in time.", tone: "warn" });
    expect(say("run.drop", { ...sampleDrop({ outcome: "unknown", reason: because("drop.link_lost") }) })).toEqual({
      text: "Whether v1 released “drop” is not known. The link is lost.",
      tone: "danger",
    });
  });

  it("tell a simulated fault, and why it was not set", () => {
    const data = { fault: "wind", value: [3, 0], actor: "desk", problem: null };
    expect(say("simulator.fault", data)).toEqual({
      text: "Simulated fault wind = [3,0] for v1 by desk.",
      tone: "warn",
    });
    expect(say("simulator.fault", { ...data, problem: "no winch" }).text).toBe(
      "Simulated fault wind = [3,0] for v1 by desk was not set: no winch.",
    );
  });

  it("tell who controls a vehicle in offboard mode, and why no longer", () => {
    expect(say("offboard.lease", { change: "acquired", holder: "ann", other: null, reason: null })).toEqual({
      text: "ann has the offboard lease of v1.",
      tone: "info",
    });
    expect(
      say("offboard.lease", { change: "revoked", holder: "ann", other: null, reason: because("offboard.link_lost") }),
    ).toEqual({ text: "ann lost the offboard lease of v1: the link to the vehicle is lost.", tone: "warn" });
    expect(say("offboard.lease", { change: "offered", holder: "ann", other: "ben", reason: null }).text).toBe(
      "ann offers the offboard lease of v1 to ben.",
    );
    expect(say("offboard.lease", { change: "overridden", holder: "ann", other: "ben", reason: null }).text).toBe(
      "ann overrode the offboard lease of v1: ben had it.",
    );
    expect(say("offboard.changed", { state: "active", holder: "ann", reason: null })).toEqual({
      text: "v1, offboard control: active.",
      tone: "warn",
    });
  });

  it("tell what becomes of tasks, and what the gripper answered", () => {
    expect(say("task.changed", { change: "reached", task_id: "t3", reason: null })).toEqual({
      text: "v1: task t3 has come to its end.",
      tone: "info",
    });
    const queued = (mode: string) =>
      say("task.changed", { change: "inserted", task_id: "t2", insert_mode: mode, reason: null }).text;
    expect(["append", "prepend", "replace_current", "replace_all", "later_mode"].map(queued)).toEqual([
      "v1: task t2 is queued at the end of the queue.",
      "v1: task t2 is queued before the current one.",
      "v1: task t2 is queued in place of the current one.",
      "v1: task t2 is queued in place of all others.",
      "v1: task t2 is queued.",
    ]);
    expect(
      say("task.changed", {
        change: "dropped",
        task_id: "t3",
        reason: because("offboard.not_renewed", { lease_s: 10 }),
      }),
    ).toEqual({
      text: "v1: task t3 and what came after it are dropped: the lease was not renewed for 10 s.",
      tone: "warn",
    });
    expect(say("task.changed", { change: "cleared", task_id: null, reason: null })).toEqual({
      text: "v1: the task queue was cleared.",
      tone: "info",
    });
    expect(
      say("task.changed", { change: "dropped", task_id: null, reason: because("offboard.service_restarted") }),
    ).toEqual({ text: "v1: the task queue was dropped: the service restarted.", tone: "warn" });
    expect(
      say("task.gripper", {
        task_id: "t3",
        action: "release",
        outcome: "failed",
        reason: because("error", { detail: "no" }),
      }).tone,
    ).toBe("danger");
  });

  it("are made for kinds to come", () => {
    expect(say("later.kind" as EventKind, {}).text).toBe("Later kind.");
  });
});
