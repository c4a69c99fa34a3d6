import { describe, expect, it } from "vitest";
import type { Capability, Offboard, Reason, SentCommand, TaskControl } from "../../api/types";
import { because } from "../../testing/samples";
import {
  deadManStage,
  describeClose,
  describeLosses,
  describeRelease,
  describeRunInTheWay,
  describeTaskControl,
  formatCommand,
  formatCommandResult,
  isLimited,
  lookAwayHint,
  summarizeCapabilities,
  takeOverHint,
} from "./labels";

type Sent = NonNullable<Offboard["sent"]>;

const sentBy = (source: Sent["source"]): Offboard => ({ state: "active", sent: { source } }) as Offboard;

describe("the dead-man's stage", () => {
  it("is zero velocity only where the dead-man itself sends: a task sends for its client", () => {
    expect((["client", "task", "dead_man"] as const).map((by) => deadManStage(sentBy(by), false))).toEqual([
      "active",
      "active",
      "zero_velocity",
    ]);
  });

  it("is nothing where nothing is sent, and Hold where it has ended the flight", () => {
    const idle = { state: "idle", sent: null } as Offboard;
    expect([deadManStage(null, false), deadManStage(idle, false), deadManStage(idle, true)]).toEqual([
      null,
      null,
      "hold",
    ]);
  });
});

describe("a lease that this page released", () => {
  it("says whose it was, why, and what became of a vehicle that was flown", () => {
    expect(describeRelease("asked", { flown: false, vehicle: "v2" })).toBe("You released the lease.");
    expect(describeRelease("left_panel", { flown: false, vehicle: "v2" })).toBe(
      "You left this panel, which released the lease of v2.",
    );
    expect(describeRelease("other_vehicle", { flown: true, vehicle: "v2" })).toBe(
      "You selected another vehicle, which released the lease of v2; v2 holds.",
    );
  });
});

describe("the end of the socket", () => {
  const said = (code: number, reason = "") => describeClose(code, reason, { ended: "", offboard: null });

  it("is told in the page's words where it knows the code, else in the service's", () => {
    expect(said(1013, "the token cannot be looked at now")).toBe(
      "The service cannot check the token now. Try again in a moment.",
    );
    expect(said(4403)).toBe("Only a pilot can use manual control.");
    expect(said(4999, "why not")).toBe("Why not.");
    expect(said(4999)).toBe("Closed with code 4999.");
  });
});

const spaced = (text: string) => text.replaceAll("\u00a0", " ");
const ORDER: SentCommand = {
  command: "DO_REPOSITION",
  latitude_deg: 47.4,
  longitude_deg: 8.55,
  altitude_m: 540,
  radius_m: null,
  outcome: "sent",
  result: null,
  age_s: 0.1,
};

describe("a vehicle that is commanded", () => {
  it("is told from one under manual control", () => {
    for (const by of ["commands", "setpoints"] as const)
      expect(describeTaskControl("v3", by)).toContain("Keys, sticks and gamepads have no effect");
    expect([lookAwayHint("v3", "commands"), lookAwayHint("v3", "setpoints")]).toEqual([
      expect.stringContaining("circles where it is"),
      expect.stringContaining("v3 holds"),
    ]);
    expect(describeTaskControl("v3", "commands")).toContain("keeps v3 in Hold");
    expect(describeTaskControl("v3", "setpoints")).toContain("OFFBOARD");
  });

  it("says what becomes of it when the page, or Waydrop, goes away", () => {
    const [closed, hidden, dead] = describeLosses("v3", "commands").map(([, what]) => what);
    expect(closed).toBe("v3 circles where it is at once and discards its other tasks.");
    expect(hidden).toBe("The same within 10 s.");
    expect(dead).toContain("flies to the last point");
    const streamed = describeLosses("v3", "setpoints").map(([, what]) => what);
    expect([streamed[0], streamed[2]]).toEqual([
      expect.stringContaining("v3 holds"),
      expect.stringContaining("COM_OBL_RC_ACT"),
    ]);
  });

  it("says what a new holder finds: no tasks, and where there is no stream without a task, no control", () => {
    expect(takeOverHint("v3", "commands")).toContain("circles where it is");
    expect(takeOverHint("v3", "setpoints")).toContain("ends the lease");
  });

  it("has its newest command and the answer in words", () => {
    expect(spaced(formatCommand(ORDER))).toBe("fly to a point, 540 m AMSL");
    expect(formatCommand({ ...ORDER, latitude_deg: null, altitude_m: null })).toBe("circle where it is");
    expect(spaced(formatCommand({ ...ORDER, command: "DO_ORBIT", radius_m: -80 }))).toBe(
      "circle of 80 m, counter-clockwise, 540 m AMSL",
    );
    const results = (["ACCEPTED", "TEMPORARILY_REJECTED", null] as const).map((result) =>
      formatCommandResult({ ...ORDER, outcome: "acknowledged", result }),
    );
    expect(results).toEqual(["accepted", "temporarily rejected", "unknown result"]);
    const outcomes = (["sent", "unanswered", "not_seen", "not_sent"] as const).map((outcome) =>
      formatCommandResult({ ...ORDER, outcome }),
    );
    expect(outcomes).toEqual(["no answer yet", "no answer", "accepted, but no change observed", "not sent"]);
  });

  it("is told that control ended when no task was left", () => {
    const left = (reason: Reason) =>
      describeClose(4410, "the lease has ended", { ended: "", offboard: { lease: null, reason } as Offboard });
    expect(left(because("offboard.left", { to: "mission" }))).toBe(
      "No task was left: control ended, and the run resumed.",
    );
    expect(left(because("offboard.left", { to: "hold" }))).toBe(
      "No task was left: control ended, and the vehicle holds.",
    );
    expect(left(because("offboard.commanded", { command: "hold" }))).toBe("An operator commanded hold.");
  });
});

const row = (form: string, accepted: boolean, reason = ""): Capability => ({ form, accepted, reason }) as Capability;

const STREAMED: TaskControl = { control_method: "setpoints", reason: "", hint: "" };

describe("what a vehicle follows of the page", () => {
  it("needs no words where it is everything", () => {
    const all = summarizeCapabilities(
      "multicopter",
      [row("velocity_body", true), row("position_global", true), row("attitude", true)],
      STREAMED,
    );
    expect([isLimited(all), all.map(({ can }) => can)]).toEqual([false, [true, true, true]]);
  });

  it("is told for a wing with the reason for each, attitude sticks too", () => {
    const wing = summarizeCapabilities(
      "fixed_wing",
      [
        row("velocity_body", false, "PX4 does not follow it on this vehicle"),
        row("position_global", true),
        row("attitude", true),
      ],
      { control_method: "commands", reason: "", hint: "" },
    );
    expect(isLimited(wing)).toBe(true);
    expect(wing.map(({ name, can }) => [name, can])).toEqual([
      ["Keys, sticks and gamepad", false],
      ["Go to a point on the map", true],
      ["Tasks", true],
      ["Attitude sticks", false],
    ]);
    expect(wing[0]?.why).toBe("PX4 does not follow it on this vehicle.");
    expect(wing[2]?.why).toContain("DO_REPOSITION");
    expect(wing[3]?.why).toContain("a network may delay them");
  });

  it("is nothing for an airship, with PX4's reason", () => {
    const why = "PX4 supports no setpoints for airships";
    const airship = summarizeCapabilities(
      "airship",
      [row("velocity_body", false, why), row("position_global", false, why), row("attitude", false, why)],
      { control_method: null, reason: "none that flies to a place", hint: "send it there by a plan" },
    );
    expect(airship.map(({ can }) => can)).toEqual([false, false, false]);
    expect(airship[2]?.why).toBe("None that flies to a place. Send it there by a plan.");
  });

  it("is not claimed before the service has told it", () => {
    expect(
      summarizeCapabilities(null, [], { control_method: null, reason: "", hint: "" }).every(
        ({ can, why }) => !can && why === "",
      ),
    ).toBe(true);
  });
});

describe("a run in the way of control", () => {
  it("is said to fly only if it does", () => {
    expect(
      (["uploading", "uploaded", "flying", "at_drop", "returning"] as const).map((state) =>
        describeRunInTheWay("v1", state, "Clinic run"),
      ),
    ).toEqual([
      "“Clinic run” is being uploaded to v1.",
      "“Clinic run” is uploaded to v1, but not started.",
      "v1 is flying “Clinic run”.",
      "v1 is flying “Clinic run”: at the drop.",
      "v1 is flying “Clinic run”: returning.",
    ]);
    expect(describeRunInTheWay("v1", "uploaded", null)).toBe("A run is uploaded to v1, but not started.");
  });
});
