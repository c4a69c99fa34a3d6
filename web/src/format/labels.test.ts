import { describe, expect, it } from "vitest";
import type { LandedState } from "../api/types";
import { asSentence, landedName, modeTone, plain } from "./labels";

describe("words", () => {
  it("that the page does not know are shown as they are", () => {
    expect([plain("some_new_mode"), landedName("submerged" as LandedState)]).toEqual(["Some new mode", "Submerged"]);
  });
});

describe("Mission mode", () => {
  it("looks like a flight only in one", () => {
    const tone = (armed: boolean, landed: string, mode: string | null = "mission") => modeTone({ mode, armed, landed });
    expect([
      tone(true, "in_air"),
      tone(true, "taking_off"),
      tone(true, "on_ground"),
      tone(false, "undefined"),
      tone(true, "in_air", "hold"),
    ]).toEqual(["info", "info", "neutral", "neutral", "neutral"]);
  });
});

describe("the service's clauses", () => {
  it("become sentences, and names in them stay names", () => {
    expect([
      asSentence("the gripper follows no item"),
      asSentence("hold_s is too long"),
      asSentence("v1 is busy"),
      asSentence(""),
    ]).toEqual(["The gripper follows no item", "hold_s is too long", "v1 is busy", ""]);
  });
});
