import { describe, expect, it } from "vitest";
import { sampleRun, sampleState, sampleVehicle } from "../../testing/samples";
import { type FleetGroup, matchesFleetFilter } from "./filter";

const parked = sampleVehicle({ id: "v1" });
const flying = sampleVehicle({
  id: "north-7",
  vehicle_type: "vtol",
  state: sampleState({ landed: "in_air", mode: "return" }),
});

describe("the fleet's filter", () => {
  it("finds by every word of what is known of a vehicle", () => {
    const found = (query: string) =>
      [parked, flying].filter((one) => matchesFleetFilter(one, null, query, "all")).map(({ id }) => id);
    expect([found(""), found("NORTH"), found("vtol return"), found("vtol hold"), found("multi")]).toEqual([
      ["v1", "north-7"],
      ["north-7"],
      ["north-7"],
      [],
      ["v1"],
    ]);
  });

  it("finds a vehicle by what its run does", () => {
    expect([
      matchesFleetFilter(parked, sampleRun({ item_id: "clinic" }), "clinic", "run"),
      matchesFleetFilter(parked, null, "", "run"),
    ]).toEqual([true, false]);
  });

  it("knows who is in the air", () => {
    expect([parked, flying].map((one) => matchesFleetFilter(one, null, "", "air"))).toEqual([false, true]);
  });

  it.each([
    ["nothing", sampleVehicle(), false],
    ["quarantine", sampleVehicle({ quarantined: { code: "vehicle.two_clocks", params: {}, cause: null } }), true],
    ["a failsafe", sampleVehicle({ state: sampleState({ in_failsafe: true }) }), true],
    ["a lost link", sampleVehicle({ state: sampleState({ connected: false }) }), true],
    ["a silent link", sampleVehicle({ state: sampleState({ heartbeat_age_s: 3 }) }), true],
    ["a low battery", sampleVehicle({ state: sampleState({ battery_percent: 12 }) }), true],
    ["an unknown battery", sampleVehicle({ state: sampleState({ battery_percent: null }) }), false],
  ])("asks for a look at %s", (_, vehicle, wanted) => {
    expect(matchesFleetFilter(vehicle, null, "", "attention" satisfies FleetGroup)).toBe(wanted);
  });
});
