import { describe, expect, it } from "vitest";
import { parseJobForm } from "./job-form";

const TYPED = { vehicle: "any", priority: "0", deadline: "", autoStart: false };

describe("what is typed about a job", () => {
  it("is any vehicle, no deadline and a person's start unless something else is typed", () => {
    expect(parseJobForm(TYPED)).toEqual({
      order: { vehicle: "any", priority: 0, deadline: null, auto_start: false },
    });
  });

  it("sends local time with its zone", () => {
    const parsed = parseJobForm({ ...TYPED, vehicle: "v2", priority: " -5 ", deadline: "2030-01-02T03:04" });
    const deadline = new Date("2030-01-02T03:04").toISOString();
    expect(parsed).toEqual({ order: { vehicle: "v2", priority: -5, deadline, auto_start: false } });
  });

  it.each(["", "1.5", "101", "-101", "high", "1e1"])("refuses the priority %j and says what is allowed", (priority) => {
    expect(parseJobForm({ ...TYPED, priority })).toEqual({
      error: "Enter a whole number from −100 to 100 as the priority.",
    });
  });
});
