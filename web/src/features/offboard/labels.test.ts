import { describe, expect, it } from "vitest";
import type { Capability, FlightOrder, Offboard, Reason, TaskMeans } from "../../api/types";
import { because } from "../../testing/samples";
import {
  abilitiesOf,
  closeWords,
  commandedWords,
  givenBackWords,
  goneWords,
  isLimited,
  lookAwayWords,
  orderWords,
  resultWords,
  stageOf,
  takeOverWords,
} from "./labels";

type Sent = NonNullable<Offboard["sent"]>;

const sentBy = (source: Sent["source"]): Offboard => ({ state: "active", sent: { source } }) as Offboard;

describe("the dead-man's stage", () => {
  it("is silence only where the dead-man itself sends: a task speaks for its client", () => {
    expect((["client", "task", "dead_man"] as const).map((by) => stageOf(sentBy(by), false))).toEqual([
      "speaks",
      "speaks",
      "silent",
    ]);
  });

  it("is nothing where nothing is sent, and gone where it has ended the flight", () => {
    const idle = { state: "idle", sent: null } as Offboard;
    expect([stageOf(null, false), stageOf(idle, false), stageOf(idle, true)]).toEqual([null, null, "gone"]);
  });
});

describe("a lease that this page gave back", () => {
  it("says whose it was, why, and what became of a vehicle that was flown", () => {
    expect(givenBackWords("asked", { phase: "leased", vehicle: "v2" })).toBe("The lease was given back.");
    expect(givenBackWords("left_view", { phase: "leased", vehicle: "v2" })).toBe(
      "You left this view: the lease of v2 was given back.",
    );
    expect(givenBackWords("other_vehicle", { phase: "flying", vehicle: "v2" })).toBe(
      "You chose another vehicle: the lease of v2 was given back, and v2 was told to hold.",
    );
  });
});

describe("the end of the socket", () => {
  const said = (code: number, reason = "") => closeWords(code, reason, { ended: "", offboard: null });

  it("is told in the page's words where it knows the code, else in the service's", () => {
    expect(said(1013, "the token cannot be looked at now")).toBe(
      "The service cannot look at the token now; try again in a moment.",
    );
    expect(said(4403)).toBe("Only a pilot may use manual control.");
    expect(said(4999, "why not")).toBe("Why not.");
    expect(said(4999)).toBe("Closed with 4999.");
  });
});

const spaced = (text: string) => text.replaceAll("\u00a0", " ");
const ORDER: FlightOrder = {
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
      expect(commandedWords("v3", by)).toContain("this page sends no setpoints");
    expect([lookAwayWords("v3", "commands"), lookAwayWords("v3", "setpoints")]).toEqual([
      expect.stringContaining("circles where it is"),
      expect.stringContaining("v3 holds"),
    ]);
    expect(commandedWords("v3", "commands")).toContain("stays in Hold");
    expect(commandedWords("v3", "setpoints")).toContain("OFFBOARD");
  });

  it("says what becomes of it when the page, or Waydrop, goes away", () => {
    const [closed, hidden, dead] = goneWords("v3", "commands").map(([, what]) => what);
    expect(closed).toBe("v3 is told to circle where it is at once, and the rest of its tasks is dropped.");
    expect(hidden).toBe("The same within 10 s.");
    expect(dead).toContain("flies on to the place it was last sent to");
    const streamed = goneWords("v3", "setpoints").map(([, what]) => what);
    expect([streamed[0], streamed[2]]).toEqual([
      expect.stringContaining("told to hold"),
      expect.stringContaining("COM_OBL_RC_ACT"),
    ]);
  });

  it("says what a new holder finds: no tasks, and where there is no stream without a task, no control", () => {
    expect(takeOverWords("v3", "commands")).toContain("circles where it is");
    expect(takeOverWords("v3", "setpoints")).toContain("ends the lease");
  });

  it("has its newest command and the answer in words", () => {
    expect(spaced(orderWords(ORDER))).toBe("fly to a place, 540 m AMSL");
    expect(orderWords({ ...ORDER, latitude_deg: null, altitude_m: null })).toBe("circle where it is");
    expect(spaced(orderWords({ ...ORDER, command: "DO_ORBIT", radius_m: -80 }))).toBe(
      "circle of 80 m, counter-clockwise, 540 m AMSL",
    );
    expect(
      (["ACCEPTED", "TEMPORARILY_REJECTED", null] as const).map((result) =>
        resultWords({ ...ORDER, outcome: "acknowledged", result }),
      ),
    ).toEqual(["accepted", "temporarily rejected", "an unknown result"]);
    expect(
      (["sent", "unanswered", "not_seen", "not_sent"] as const).map((outcome) => resultWords({ ...ORDER, outcome })),
    ).toEqual(["no answer yet", "no answer", "accepted, not seen", "not sent"]);
  });

  it("is told that control went back when no task was left", () => {
    const left = (reason: Reason) =>
      closeWords(4410, "the lease has ended", { ended: "", offboard: { lease: null, reason } as Offboard });
    expect(left(because("offboard.left", { to: "mission" }))).toBe(
      "No task was left: control went back, and the run goes on.",
    );
    expect(left(because("offboard.left", { to: "hold" }))).toBe(
      "No task was left: control went back, and the vehicle holds.",
    );
    expect(left(because("offboard.commanded", { command: "hold" }))).toBe("An operator commanded hold.");
  });
});

const row = (form: string, taken: boolean, reason = ""): Capability => ({ form, taken, reason }) as Capability;

const STREAMED: TaskMeans = { flown_by: "setpoints", reason: "", hint: "" };

describe("what a vehicle follows of the page", () => {
  it("needs no words where it is everything", () => {
    const all = abilitiesOf(
      "multicopter",
      [row("velocity_body", true), row("position_global", true), row("attitude", true)],
      STREAMED,
    );
    expect([isLimited(all), all.map(({ can }) => can)]).toEqual([false, [true, true, true]]);
  });

  it("is told for a wing with the reason for each, attitude sticks too", () => {
    const wing = abilitiesOf(
      "fixed_wing",
      [
        row("velocity_body", false, "PX4 does not follow it on this vehicle"),
        row("position_global", true),
        row("attitude", true),
      ],
      { flown_by: "commands", reason: "", hint: "" },
    );
    expect(isLimited(wing)).toBe(true);
    expect(wing.map(({ name, can }) => [name, can])).toEqual([
      ["Keys, sticks and gamepad", false],
      ["Go to a place by a click", true],
      ["Tasks", true],
      ["Attitude sticks", false],
    ]);
    expect(wing[0]?.why).toBe("PX4 does not follow it on this vehicle.");
    expect(wing[2]?.why).toContain("DO_REPOSITION");
    expect(wing[3]?.why).toContain("late over a network");
  });

  it("is nothing for an airship, with PX4's reason", () => {
    const why = "PX4 names no setpoint that an airship follows";
    const airship = abilitiesOf(
      "airship",
      [row("velocity_body", false, why), row("position_global", false, why), row("attitude", false, why)],
      { flown_by: null, reason: "none that flies to a place", hint: "send it there by a plan" },
    );
    expect(airship.map(({ can }) => can)).toEqual([false, false, false]);
    expect(airship[2]?.why).toBe("None that flies to a place. Send it there by a plan.");
  });

  it("is not claimed before the service has told it", () => {
    expect(
      abilitiesOf(null, [], { flown_by: null, reason: "", hint: "" }).every(({ can, why }) => !can && why === ""),
    ).toBe(true);
  });
});
