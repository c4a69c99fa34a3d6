import { describe, expect, it } from "vitest";
import { because, sampleJob } from "../../testing/samples";
import { candidateWords, jobStateName, startWords, vehicleWords } from "./labels";

const refusal = {
  code: "vehicle.battery_low",
  message: "12 % battery, and the job asks for 30 %",
  reason: null,
  hint: "charge it",
  pointer: null,
  lasting: false,
};
const candidate = {
  vehicle_id: "v1",
  chosen: false,
  reason: null,
  distance_m: null,
  battery_percent: null,
  refusals: [],
  refusals_left_out: 0,
  lasting: false,
};

describe("a job in words", () => {
  it("says which vehicle it has, or may have", () => {
    expect(vehicleWords(sampleJob({ vehicle_id: "v2" }))).toBe("Given to v2");
    expect(vehicleWords(sampleJob())).toBe("For any multicopter");
    expect(vehicleWords(sampleJob({ vehicle_type: "vtol" }))).toBe("For any VTOL");
    expect(
      vehicleWords(sampleJob({ wish: { vehicle: "any", allowed_vehicles: ["v1", "v2"], min_battery_percent: 0 } })),
    ).toBe("For v1 or v2");
    expect(vehicleWords(sampleJob({ wish: { vehicle: "v3", allowed_vehicles: [], min_battery_percent: 0 } }))).toBe(
      "For v3",
    );
  });

  it("says who starts it, and until when", () => {
    const words = startWords(sampleJob({ deadline: 1000, auto_start: true, priority: 5 }), 880);
    expect(words).toEqual([
      expect.stringMatching(/^to start by .* \(in 2 min 00 s\)$/),
      "starts by itself",
      "priority 5",
    ]);
    expect(startWords(sampleJob(), null)).toEqual(["a person starts it"]);
  });

  it("says that it is being taken off its vehicle", () => {
    expect(jobStateName(sampleJob({ state: "prepared", end_asked: "cancelled" }))).toBe("Is taken off");
  });

  it("tells every reason against a vehicle, with its hint", () => {
    expect(candidateWords({ ...candidate, refusals: [refusal], refusals_left_out: 3 })).toEqual([
      "12 % battery, and the job asks for 30 %. Charge it.",
      "And 3 more.",
    ]);
    expect(candidateWords({ ...candidate, reason: because("job.chosen"), distance_m: 30 })).toEqual([
      "Chosen from the suitable vehicles, 30 m from the start.",
    ]);
    expect(candidateWords(candidate)).toEqual(["Nothing speaks against it."]);
  });
});
