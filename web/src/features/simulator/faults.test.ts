import { describe, expect, it } from "vitest";
import type { FaultKind, SimulatedVehicle } from "../../api/types";
import { controlOf } from "../../ui/schema-control";
import { activeFaults, clearingValue, faultLabel, faultUnit, formatFaultValue, parseFaultValue } from "./faults";

function kind(fault: string, value_schema: Record<string, unknown>): FaultKind {
  return { fault, effect: "", value_schema };
}

const WIND = { type: "array", unit: "m/s", prefixItems: [{ type: "number" }, { type: "number" }] };

function vehicle(vehicle_id: string, faults: Record<string, unknown>): SimulatedVehicle {
  return { vehicle_id, faults } as unknown as SimulatedVehicle;
}

describe("a fault", () => {
  it("is named and measured in words", () => {
    expect([faultLabel("battery_percent"), faultUnit(kind("battery_percent", {}))]).toEqual(["Battery", "%"]);
    expect(faultUnit(kind("wind", WIND))).toBe("m/s");
    expect([formatFaultValue(true), formatFaultValue([3, -2.5]), formatFaultValue(0.1)]).toEqual([
      "on",
      "3, -2.5",
      "0.1",
    ]);
  });

  it("is cleared by the value of its schema that means none, and by no value if there is none", () => {
    expect(clearingValue(kind("link_cut", { type: "boolean" }))).toBe(false);
    expect(clearingValue(kind("loss", { type: "number", minimum: 0, maximum: 1 }))).toBe(0);
    expect(clearingValue(kind("wind", WIND))).toEqual([0, 0]);
    expect(clearingValue(kind("mode", { enum: ["RTL"] }))).toBeUndefined();
    expect(clearingValue(kind("sats", { type: "integer", minimum: 4 }))).toBeUndefined();
  });
});

describe("the lasting faults", () => {
  const vehicles = [vehicle("v1", { loss: 0.1, wind: [3, 0] }), vehicle("v2", { loss: 0.2, wind: [3, 0] })];

  it("are those of one vehicle, or those that all share", () => {
    expect(activeFaults(vehicles, "v1")).toEqual({ loss: 0.1, wind: [3, 0] });
    expect(activeFaults(vehicles, null)).toEqual({ wind: [3, 0] });
    expect([activeFaults(vehicles, "v9"), activeFaults([], null)]).toEqual([{}, {}]);
  });
});

describe("what is typed", () => {
  it("becomes a value of the schema's type, or a word about it", () => {
    const integer = controlOf({ type: "integer" });
    expect(parseFaultValue(integer, ["4"])).toEqual({ value: 4 });
    expect(parseFaultValue(integer, ["4.5"])).toEqual({ error: "Enter a whole number." });
    expect(parseFaultValue(controlOf({ type: "number" }), [" 0,5 "])).toEqual({ value: 0.5 });
    expect(parseFaultValue(controlOf({ type: "number" }), [""])).toMatchObject({
      error: expect.stringContaining("number"),
    });
    expect(parseFaultValue(controlOf(WIND), ["3", "-2.5"])).toEqual({ value: [3, -2.5] });
    expect(parseFaultValue(controlOf(WIND), ["3", "x"])).toMatchObject({ error: expect.any(String) });
    expect(parseFaultValue(controlOf({ enum: ["RTL"] }), [""])).toMatchObject({
      error: expect.stringContaining("Select"),
    });
  });
});
