import { describe, expect, it } from "vitest";
import { availableActions } from "./vehicle-actions";

describe("what a vehicle without a run can be told", () => {
  it("is everything when it is armed", () => {
    expect(availableActions({ armed: true, mode: "offboard" })).toEqual(["hold", "return", "land"]);
  });

  it.each(["offboard", "position", "manual", "return", "land", "other"] as const)(
    "is to hold when it was left in %s",
    (mode) => {
      expect(availableActions({ armed: false, mode })).toEqual(["hold"]);
    },
  );

  it("is nothing where it arms, or when nothing is known of it", () => {
    expect(availableActions({ armed: false, mode: "hold" })).toEqual([]);
    expect(availableActions({ armed: false, mode: "mission" })).toEqual([]);
    expect(availableActions({ armed: null, mode: null })).toEqual([]);
  });
});
