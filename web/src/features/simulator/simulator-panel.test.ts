import { describe, expect, it } from "vitest";
import { paceWords } from "./simulator-panel";

const REAL = { wanted: 1, achieved: 1, behind: false, live: true, live_max: 4, max: 50 };

describe("the speed of simulated time in words", () => {
  it("says from where on live control is refused", () => {
    expect(paceWords(REAL)).toBe("Time runs as ours. Above 4×, supervised drops and offboard control are refused.");
  });
  it("says what is refused now", () => {
    expect(paceWords({ ...REAL, wanted: 20, achieved: null, live: false })).toBe(
      "Time runs 20× as fast as ours. Supervised drops and offboard control are refused above 4×: only embedded missions fly now.",
    );
  });
  it("says it when the machine is too slow", () => {
    expect(paceWords({ ...REAL, wanted: 4, achieved: 2.34, behind: true })).toContain(
      "This machine keeps only 2.3×: the vehicles fly the same, later.",
    );
  });
});
