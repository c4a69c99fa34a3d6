import { describe, expect, it } from "vitest";
import type { EventKind } from "../../api/types";
import { because, type EventFields, sampleDrop, sampleEvent, sampleRun } from "../../testing/samples";
import { formatEvent } from "./format-event";

describe("an event", () => {
  const format = (kind: EventKind, data: object, fields: EventFields = {}) =>
    formatEvent(sampleEvent(1, { kind, data, vehicle_id: "v1", run_id: "r1", ...fields }));

  it("says what happened to which vehicle", () => {
    expect(format("vehicle.link_lost", {}).text).toBe("v1: link lost.");
    expect(format("vehicle.changed", { mode: "mission", armed: true, landed: "in_air", in_failsafe: false }).text).toBe(
      "v1: Mission mode, armed, in the air.",
    );
    expect(format("vehicle.changed", { mode: "return", in_failsafe: true })).toEqual({
      text: "v1 is in failsafe, mode Return.",
      tone: "danger",
    });
    expect(format("vehicle.parameters", { parameters: { NAV_ACC_RAD: 3.5, PD_GRIPPER_TYPE: -1 } }).text).toBe(
      "v1: parameters changed: NAV_ACC_RAD 3.5, PD_GRIPPER_TYPE -1.",
    );
    expect(format("run.plan_refused", { code: "plan.rejected", findings: [] }).text).toBe(
      "Run r1 did not start: v1 would not fly its plan with its present settings.",
    );
    const site = { site: "north", taken_by: "gw-2" };
    expect(format("service.site_lease", { ...site, has_expired: false }).text).toBe(
      "Another gateway (gw-2) has the site north: no run can begin here.",
    );
    expect(format("service.site_lease", { ...site, has_expired: true }).text).toBe(
      "Gateway gw-2, which had the site north, is not heard. If it is switched off, let this gateway take over: waydrop take-over.",
    );
    const taken_over = { gateway: "gw-2", from_gateway: "gw-1", number: 1, at: 1, is_found: false };
    expect(format("run.taken_over", { ...sampleRun(), taken_over })).toEqual({
      text: "v1: gateway gw-2 goes on with run r1 of gw-1.",
      tone: "warn",
    });
    expect(format("run.upload_progress", { mission_type: "fence", sent: 2, total: 4 }).text).toBe(
      "v1: uploading the fence: 2 of 4.",
    );
    expect(
      format("run.changed", {
        ...sampleRun({ state: "failed", reason: because("error", { error: "link", detail: "no answer" }) }),
      }),
    ).toEqual({ text: "Run r1 on v1: failed. No answer.", tone: "danger" });
    expect(
      format("run.changed", { ...sampleRun({ state: "uploaded", reason: because("run.upload_verified") }) }).text,
    ).toBe("Run r1 on v1: ready to start. The vehicle reports the ID of the uploaded mission.");
    expect(
      format("run.changed", { ...sampleRun({ state: "paused", reason: because("run.resuming_as_asked") }) }),
    ).toEqual({ text: "Run r1 on v1 resumes.", tone: "info" });
    expect(
      format("run.changed", { ...sampleRun({ state: "paused", reason: because("run.paused_as_asked") }) }).tone,
    ).toBe("warn");
    expect(format("run.changed", { ...sampleRun({ state: "returning", reason: because("run.on_ground") }) }).tone).toBe(
      "info",
    );
    expect(format("run.changed", { ...sampleRun({ state: "returning", reason: because("run.failsafe") }) }).tone).toBe(
      "warn",
    );
  });

  it("names a run by its plan, and by its id where the plan is not known", () => {
    const event = (kind: EventKind, plan_id: string) =>
      sampleEvent(1, {
        kind,
        data: { ...sampleRun({ state: "flying" }), plan_id, continued_by: "r2" },
        vehicle_id: "v1",
        run_id: "r1",
      });
    const name = (plan_id: string) => (plan_id === "p1" ? "Clinic run" : null);
    expect(formatEvent(event("run.changed", "p1"), name).text).toBe("“Clinic run” on v1: flying.");
    expect(formatEvent(event("run.created", "p1"), name).text).toBe("“Clinic run” was created for v1.");
    expect(formatEvent(event("run.changed", "p2"), name).text).toBe("Run r1 on v1: flying.");
    expect(formatEvent(event("run.continued", "p2"), name).text).toBe("v1: run r2 flies the rest of run r1.");
  });

  it("keeps what was sent apart from what was answered", () => {
    expect(format("run.command", { command: "DO_GRIPPER", attempt: 2 }).text).toBe("Sent DO_GRIPPER to v1 (try 2).");
    expect(
      format("run.ack", { command: "DO_GRIPPER", outcome: "acknowledged", result: "ACCEPTED", progress: 0 }),
    ).toEqual({ text: "v1 answered DO_GRIPPER: accepted.", tone: "ok" });
    expect(
      format("run.ack", { command: "DO_GRIPPER", outcome: "acknowledged", result: "DENIED", progress: null }).tone,
    ).toBe("danger");
    expect(format("run.ack", { command: "DO_GRIPPER", outcome: "not_sent", detail: "too late" })).toEqual({
      text: "v1: DO_GRIPPER: not sent: too late.",
      tone: "danger",
    });
    expect(format("run.ack", { command: "arm", outcome: "done", detail: "" })).toEqual({
      text: "v1: ARM: done.",
      tone: "ok",
    });
  });

  it("claims no more of a drop than is known", () => {
    const alone = format("run.drop", {
      ...sampleDrop({ outcome: "released", certainty: "acknowledged", output_evidence: "not_assigned" }),
    });
    expect(alone).toEqual({
      text: "v1 acknowledged the release of “drop”; no output was observed to move.",
      tone: "warn",
    });
    expect(format("run.drop", { ...sampleDrop({ outcome: "released", certainty: "acknowledged" }) }).text).toBe(
      "v1 released “drop”, acknowledged by the vehicle.",
    );
    expect(format("drop.consent_asked", { plan_item_id: "drop" }).text).toBe(
      "v1 holds at “drop” and waits for consent.",
    );
    expect(
      format("drop.consent_closed", {
        plan_item_id: "drop",
        state: "granted",
        actor: "anna",
        comment: "gate is closed",
        reason: null,
      }).text,
    ).toBe("“drop”: Consent granted by anna: gate is closed.");
    expect(
      format("drop.consent_closed", {
        plan_item_id: "drop",
        state: "timed_out",
        actor: null,
        comment: "",
        reason: null,
      }),
    ).toEqual({ text: "“drop”: Consent timed out.", tone: "warn" });
    expect(format("run.drop", { ...sampleDrop({ outcome: "unknown", reason: because("drop.link_lost") }) })).toEqual({
      text: "It is unknown whether v1 released “drop”. The link is lost.",
      tone: "danger",
    });
  });

  it("tells a simulated fault, and why it was not set", () => {
    const data = { fault: "wind", value: [3, 0], actor: "desk", problem: null };
    expect(format("simulator.fault", data)).toEqual({
      text: "desk set the simulated fault wind = [3,0] for v1.",
      tone: "warn",
    });
    expect(format("simulator.fault", { ...data, problem: "no winch" }).text).toBe(
      "desk set the simulated fault wind = [3,0] for v1, but it failed: no winch.",
    );
  });

  it("tells who controls a vehicle in offboard mode, and why no longer", () => {
    expect(format("offboard.lease", { change: "acquired", holder: "ann", other: null, reason: null })).toEqual({
      text: "ann took the lease of v1.",
      tone: "info",
    });
    expect(
      format("offboard.lease", {
        change: "revoked",
        holder: "ann",
        other: null,
        reason: because("offboard.link_lost"),
      }),
    ).toEqual({ text: "ann lost the lease of v1: the link to the vehicle is lost.", tone: "warn" });
    expect(format("offboard.lease", { change: "offered", holder: "ann", other: "ben", reason: null }).text).toBe(
      "ann offered ben the lease of v1.",
    );
    expect(format("offboard.lease", { change: "overridden", holder: "ann", other: "ben", reason: null }).text).toBe(
      "ann overrode ben's lease of v1.",
    );
    expect(format("offboard.changed", { state: "active", holder: "ann", reason: null })).toEqual({
      text: "v1: manual control on.",
      tone: "warn",
    });
  });

  it("tells what becomes of tasks, and what the gripper answered", () => {
    expect(format("task.changed", { change: "reached", task_id: "t3", reason: null })).toEqual({
      text: "v1: task t3 is complete.",
      tone: "info",
    });
    const queued = (mode: string) =>
      format("task.changed", { change: "inserted", task_id: "t2", insert_mode: mode, reason: null }).text;
    expect(["append", "prepend", "replace_current", "replace_all", "later_mode"].map(queued)).toEqual([
      "v1: task t2 was queued at the end.",
      "v1: task t2 was queued before the current task.",
      "v1: task t2 was queued instead of the current task.",
      "v1: task t2 was queued instead of all others.",
      "v1: task t2 was queued.",
    ]);
    expect(
      format("task.changed", {
        change: "dropped",
        task_id: "t3",
        reason: because("offboard.not_renewed", { lease_s: 10 }),
      }),
    ).toEqual({
      text: "v1: the tasks from t3 on were discarded: the lease was not renewed for 10 s.",
      tone: "warn",
    });
    expect(format("task.changed", { change: "cleared", task_id: null, reason: null })).toEqual({
      text: "v1: the task queue was cleared.",
      tone: "info",
    });
    expect(
      format("task.changed", { change: "dropped", task_id: null, reason: because("offboard.service_restarted") }),
    ).toEqual({ text: "v1: the task queue was discarded: the service restarted.", tone: "warn" });
    expect(
      format("task.gripper", {
        task_id: "t3",
        action: "release",
        outcome: "failed",
        reason: because("error", { detail: "no" }),
      }).tone,
    ).toBe("danger");
  });

  it("of a kind that only a newer service knows is named by its kind", () => {
    expect(format("later.kind" as EventKind, {}).text).toBe("Later kind.");
  });
});
