import { describe, expect, it } from "vitest";
import type { Capability, TaskMeans } from "../api/types";
import { abilitiesOf, isLimited } from "./abilities";

const row = (form: string, taken: boolean, reason = ""): Capability => ({ form, taken, reason }) as Capability;

const STREAMED: TaskMeans = { flown_by: "setpoints", reason: "", hint: "" };

describe("what a vehicle follows of the page", () => {
  it("needs no words where it is everything", () => {
    const all = abilitiesOf("multicopter", [row("velocity_body", true), row("position_global", true), row("attitude", true)], STREAMED);
    expect([isLimited(all), all.map(({ can }) => can)]).toEqual([false, [true, true, true]]);
  });

  it("is told for a wing with the reason for each, attitude sticks too", () => {
    const wing = abilitiesOf("fixed_wing", [row("velocity_body", false, "PX4 does not follow it on this vehicle"), row("position_global", true), row("attitude", true)], { flown_by: "commands", reason: "", hint: "" });
    expect(isLimited(wing)).toBe(true);
    expect(wing.map(({ name, can }) => [name, can])).toEqual([["Keys, sticks and gamepad", false], ["Go to a place by a click", true], ["Tasks", true], ["Attitude sticks", false]]);
    expect(wing[0]?.why).toBe("PX4 does not follow it on this vehicle.");
    expect(wing[2]?.why).toContain("DO_REPOSITION");
    expect(wing[3]?.why).toContain("late over a network");
  });

  it("is nothing for an airship, with PX4's reason", () => {
    const why = "PX4 names no setpoint that an airship follows";
    const airship = abilitiesOf("airship", [row("velocity_body", false, why), row("position_global", false, why), row("attitude", false, why)], { flown_by: null, reason: "none that flies to a place", hint: "send it there by a plan" });
    expect(airship.map(({ can }) => can)).toEqual([false, false, false]);
    expect(airship[2]?.why).toBe("None that flies to a place. Send it there by a plan.");
  });

  it("is not claimed before the service has told it", () => {
    expect(abilitiesOf(null, [], { flown_by: null, reason: "", hint: "" }).every(({ can, why }) => !can && why === "")).toBe(true);
  });
});
