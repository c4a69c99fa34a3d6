import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import { dropPoints, findingItem, parsePlanText, viewPlan } from "./document";

const clinic = viewPlan(
  JSON.parse(readFileSync(new URL("../../../../plans/clinic-run.json", import.meta.url), "utf8")),
);

describe("a plan's text", () => {
  it("is nothing, an error in words, or a plan", () => {
    expect(parsePlanText(" \n")).toBeNull();
    expect(parsePlanText("{ nope")).toMatchObject({ error: expect.stringContaining("not JSON") });
    expect(parsePlanText("[1]")).toMatchObject({ error: expect.stringContaining("JSON object") });
    expect(parsePlanText('{"name":"x"}')).toEqual({ plan: { name: "x" } });
  });
});

describe("a plan that is half written", () => {
  it("is read as far as it goes, whatever stands in it", () => {
    const plan = viewPlan({
      name: 7,
      items: [null, { type: "waypoint", latitude_deg: "x" }, { latitude_deg: 470, longitude_deg: 8 }],
      geofence: { polygons: [{ vertices: [{}] }], circles: "no" },
    });
    expect(plan.items.map(({ id, type, at }) => [id, type, at])).toEqual([
      ["item-1", "unknown", null],
      ["item-2", "waypoint", null],
      ["item-3", "unknown", null],
    ]);
    expect([plan.name, plan.fences, viewPlan({}).items]).toEqual(["Unnamed plan", [], []]);
  });
});

describe("the example plan", () => {
  it("is read whole", () => {
    expect([
      clinic.name,
      clinic.vehicleType,
      clinic.items.length,
      clinic.fences.length,
      clinic.rallyPoints.length,
    ]).toEqual(["Clinic run", "multicopter", 5, 2, 1]);
    expect(dropPoints(clinic.items).get("drop")).toEqual(clinic.items.find(({ id }) => id === "clinic")?.at);
  });
});

describe("a finding", () => {
  it("belongs to the item of its id, else of its pointer, else to the plan", () => {
    expect(findingItem({ item_id: "drop", pointer: "/items/0" }, clinic.items)?.id).toBe("drop");
    expect(findingItem({ item_id: null, pointer: "/items/1/latitude_deg" }, clinic.items)?.id).toBe("corner");
    expect(findingItem({ item_id: null, pointer: "/name" }, clinic.items)).toBeNull();
  });
});

it("a document that is shown again is not read again", () => {
  const plan = { name: "Clinic run", items: [{ id: "a", type: "waypoint" }] };
  expect(viewPlan(plan)).toBe(viewPlan(plan));
});
