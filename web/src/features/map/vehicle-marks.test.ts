import { describe, expect, it } from "vitest";
import { sampleState, sampleVehicle } from "../../testing/samples";
import { nearestIndex, sameMarks, unwrapLongitude, vehicleMarks } from "./vehicle-marks";

const fleet = { v1: sampleVehicle({ id: "v1" }), v2: sampleVehicle({ id: "v2" }), v3: sampleVehicle({ id: "v3" }) };

describe("vehicles on the map", () => {
  const icon = (fields: object, live = true) =>
    vehicleMarks({ v1: sampleVehicle({ state: sampleState(fields) }) }, null, live)[0]?.icon.split(":")[2];

  it("look stale without a link or without a connection, and endangered in failsafe", () => {
    expect([
      icon({}),
      icon({ connected: false }),
      icon({ heartbeat_age_s: 9 }),
      icon({}, false),
      icon({ in_failsafe: true }),
    ]).toEqual(["ok", "stale", "stale", "stale", "danger"]);
  });

  it("that are lost say so beside what was measured last", () => {
    const label = (fields: object) =>
      vehicleMarks({ v1: sampleVehicle({ state: sampleState(fields) }) }, null, true)[0]?.label;
    expect([
      label({}),
      label({ relative_altitude_m: 20 }),
      label({ relative_altitude_m: 20, connected: false }),
    ]).toEqual(["v1", "v1 · 20 m", "v1 · 20 m · lost"]);
  });

  it("are not drawn at a position that nobody knows", () => {
    expect(vehicleMarks({ v1: sampleVehicle({ state: sampleState({ latitude_deg: null }) }) }, null, true)).toEqual([]);
  });

  it("lie in their order, and the chosen one over all", () => {
    expect(vehicleMarks(fleet, "v1", true).map(({ id }) => id)).toEqual(["v2", "v3", "v1"]);
  });

  it("are drawn anew for whatever is seen of them, and for nothing else", () => {
    const before = vehicleMarks(fleet, null, true);
    const changed = (fields: object) =>
      vehicleMarks({ ...fleet, v2: sampleVehicle({ id: "v2", state: sampleState(fields) }) }, null, true);
    expect(sameMarks(before, changed({ battery_percent: 3, velocity_north_m_s: 1 }))).toBe(true);
    for (const seen of [
      { latitude_deg: 1 },
      { longitude_deg: 1 },
      { heading_deg: 77 },
      { relative_altitude_m: 50 },
      { in_failsafe: true },
      { connected: false },
    ])
      expect(sameMarks(before, changed(seen)), JSON.stringify(seen)).toBe(false);
    expect(sameMarks(before, vehicleMarks(fleet, "v3", true))).toBe(false);
    expect(sameMarks(before, before.slice(1))).toBe(false);
  });

  it("stand beyond the date line where they are looked at", () => {
    expect([
      unwrapLongitude(-179, 178),
      unwrapLongitude(179, -178),
      unwrapLongitude(8, 9),
      unwrapLongitude(8, 365),
    ]).toEqual([181, -181, 8, 368]);
  });
});

describe("a pointer", () => {
  it("means the nearest vehicle within its reach, and of two the upper one", () => {
    const places = [
      { x: 0, y: 0 },
      { x: 10, y: 0 },
      { x: 10, y: 0 },
      { x: 100, y: 0 },
    ];
    expect([
      nearestIndex(places, { x: 2, y: 0 }, 18),
      nearestIndex(places, { x: 9, y: 0 }, 18),
      nearestIndex(places, { x: 60, y: 0 }, 18),
      nearestIndex([], { x: 0, y: 0 }, 18),
    ]).toEqual([0, 2, null, null]);
  });
});
