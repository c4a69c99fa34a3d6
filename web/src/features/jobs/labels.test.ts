import { describe, expect, it } from "vitest";
import { because, sampleJob } from "../../testing/samples";
import { describeCandidate, describeJobStart, describeJobVehicle, jobStateLabel } from "./labels";

const refusal = {
  code: "vehicle.battery_low",
  message: "12 % battery, and the job asks for 30 %",
  reason: null,
  hint: "charge it",
  pointer: null,
  permanent: false,
};
const candidate = {
  vehicle_id: "v1",
  chosen: false,
  reason: null,
  distance_m: null,
  battery_percent: null,
  refusals: [],
  omitted_refusals: 0,
  permanent: false,
};

describe("a job in words", () => {
  it("says which vehicle it has, or may have", () => {
    expect(describeJobVehicle(sampleJob({ vehicle_id: "v2" }))).toBe("Assigned to v2");
    expect(describeJobVehicle(sampleJob())).toBe("For any multicopter");
    expect(describeJobVehicle(sampleJob({ vehicle_type: "vtol" }))).toBe("For any VTOL");
    expect(
      describeJobVehicle(
        sampleJob({ selector: { vehicle: "any", allowed_vehicles: ["v1", "v2"], min_battery_percent: 0 } }),
      ),
    ).toBe("For v1 or v2");
    expect(
      describeJobVehicle(sampleJob({ selector: { vehicle: "v3", allowed_vehicles: [], min_battery_percent: 0 } })),
    ).toBe("For v3");
  });

  it("says who starts it, and until when", () => {
    const words = describeJobStart(sampleJob({ deadline: 1000, auto_start: true, priority: 5 }), 880);
    expect(words).toEqual([
      expect.stringMatching(/^start by .* \(in 2 min 00 s\)$/),
      "starts automatically",
      "priority 5",
    ]);
    expect(describeJobStart(sampleJob(), null)).toEqual(["starts manually"]);
  });

  it("has a date for another day", () => {
    const now = new Date(2026, 6, 3, 12).getTime() / 1000;
    const [before, by] = describeJobStart(sampleJob({ not_before: now + 86_400, deadline: now + 2 * 86_400 }), now);
    expect([before, by]).toEqual(["not before 4 Jul 12:00:00", "start by 5 Jul 12:00:00 (in 2 d 0 h)"]);
    expect(describeJobStart(sampleJob({ ended_at: now - 86_400 }), now)).toEqual(["ended 2 Jul 12:00:00"]);
  });

  it("says that it is being taken off its vehicle", () => {
    expect(jobStateLabel(sampleJob({ state: "prepared", end_requested: "cancelled" }))).toBe("Ending");
  });

  it("tells every reason against a vehicle, with its hint", () => {
    expect(describeCandidate({ ...candidate, refusals: [refusal], omitted_refusals: 3 })).toEqual([
      "12 % battery, and the job asks for 30 %. Charge it.",
      "3 more reasons.",
    ]);
    expect(describeCandidate({ ...candidate, reason: because("job.chosen"), distance_m: 30 })).toEqual([
      "Chosen from the suitable vehicles, 30 m from the start.",
    ]);
    expect(describeCandidate(candidate)).toEqual(["Available."]);
  });
});
