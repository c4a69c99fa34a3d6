import { describe, expect, it } from "vitest";
import { airframeLabel, describeSpeed } from "./simulator-panel";

const REAL = { wanted: 1, achieved: 1, behind: false, live: true, live_max: 4, max: 50 };

describe("the speed of simulated time in words", () => {
  it("says from where on live control is refused", () => {
    expect(describeSpeed(REAL)).toBe(
      "Simulated time runs in real time. Above 4×, supervised drops and manual control are refused.",
    );
  });
  it("says what is refused now", () => {
    expect(describeSpeed({ ...REAL, wanted: 20, achieved: null, live: false })).toBe(
      "Simulated time runs at 20× real time. Supervised drops and manual control are refused above 4×: only embedded missions fly now.",
    );
  });
  it("says it when the machine is too slow", () => {
    expect(describeSpeed({ ...REAL, wanted: 4, achieved: 2.34, behind: true })).toContain(
      "This computer reaches only 2.3×: flights are the same, but take longer.",
    );
  });
});

it("names airframes as the fleet does, and shows an unknown one as it is called", () => {
  expect(["quad", "plane", "vtol", "rover"].map(airframeLabel)).toEqual(["Quadcopter", "Fixed wing", "VTOL", "Rover"]);
});
