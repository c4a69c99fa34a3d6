import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import type { PlanDocument } from "../../api/types";
import { metresBetween, type Point } from "../../geo/geometry";
import { viewPlan } from "./document";
import {
  addCircle,
  addPolygon,
  addRallyPoint,
  changeType,
  ITEM_TYPES,
  insertItem,
  insertionIndex,
  moveItem,
  newItem,
  newPlan,
  removeItem,
} from "./edits";
import { dragHandle, type HandleRole, handlesOf } from "./handles";
import { valueAt, withValue } from "./pointer";
import { itemFields, itemTypes, planFields, shapeFields } from "./schema";

const clinic = JSON.parse(
  readFileSync(new URL("../../../../plans/clinic-run.json", import.meta.url), "utf8"),
) as PlanDocument;
const openapi = JSON.parse(readFileSync(new URL("../../../openapi.json", import.meta.url), "utf8")) as {
  components: { schemas: Record<string, unknown> };
};
const AT: Point = [8.55, 47.4];
const ids = (plan: PlanDocument) => viewPlan(plan).items.map(({ id }) => id);
const types = (plan: PlanDocument) => viewPlan(plan).items.map(({ type }) => type);

describe("a pointer into a plan", () => {
  it("reads, sets and takes out, and leaves the plan it was given alone", () => {
    const before = JSON.stringify(clinic);
    expect(valueAt(clinic, "/items/1/id")).toBe("corner");
    expect(valueAt(withValue(clinic, "/items/1/hold_s", 4), "/items/1/hold_s")).toBe(4);
    expect(valueAt(withValue(clinic, "/limits/max_distance_m", undefined), "/limits")).toEqual({
      max_relative_altitude_m: 60,
    });
    expect(valueAt(withValue({}, "/home/latitude_deg", 47), "/home")).toEqual({ latitude_deg: 47 });
    expect(valueAt(withValue({ "a/b": { "~": 1 } }, "/a~1b/~0", 2), "/a~1b/~0")).toBe(2);
    expect([valueAt(clinic, "/items/99/id"), valueAt(clinic, "/name/x")]).toEqual([undefined, undefined]);
    expect(JSON.stringify(clinic)).toBe(before);
  });
});

describe("a new plan", () => {
  const home = { latitude_deg: 47.4, longitude_deg: 8.55, absolute_altitude_m: 488 };

  it("has the least that its vehicle type starts and ends with", () => {
    expect(types(newPlan("multicopter", home))).toEqual(["takeoff", "return_to_launch"]);
    expect(types(newPlan("fixed_wing", home))).toEqual(["takeoff", "land"]);
    expect(types(newPlan("rover", home))).toEqual([]);
    expect(types(newPlan("airship", home))).toEqual(["takeoff"]);
    expect([newPlan("multicopter", null)["home"], newPlan("multicopter", home)["home"]]).toEqual([undefined, home]);
  });

  it("lets a wing climb out to a place ahead", () => {
    const [takeoff] = viewPlan(newPlan("fixed_wing", home)).items;
    expect(metresBetween(takeoff?.at ?? AT, AT)).toBeCloseTo(150, 0);
  });
});

describe("items", () => {
  it("go before the end of the flight, or after the chosen one and its drops", () => {
    expect(insertionIndex(clinic, null)).toBe(4);
    expect(insertionIndex(clinic, 1)).toBe(2);
    expect(insertionIndex(clinic, 2)).toBe(4);
    expect(insertionIndex(clinic, 4)).toBe(4);
    expect([insertionIndex({}, null), insertionIndex({}, 7)]).toEqual([0, 0]);
  });

  it("get an id of their own and the altitude of the item before", () => {
    const item = newItem(clinic, "waypoint", 2, [8.5512345678, 47.4]);
    expect(item).toEqual({
      id: "point",
      type: "waypoint",
      latitude_deg: 47.4,
      longitude_deg: 8.5512346,
      relative_altitude_m: 20,
    });
    expect(newItem(insertItem(clinic, 2, item), "waypoint", 3, AT)["id"]).toBe("point-2");
    expect(newItem(clinic, "gripper", 4, AT)).toMatchObject({ id: "drop-2", release_motion: "stopped" });
    expect(newItem({ vehicle_type: "fixed_wing" }, "gripper", 0, AT)).toMatchObject({
      id: "drop",
      release_motion: "moving",
    });
    expect(newItem(clinic, "jump", 4, AT)).toMatchObject({ target: "corner" });
  });

  it("are moved and removed", () => {
    expect(ids(moveItem(clinic, 1, 2))).toEqual(["takeoff", "clinic", "corner", "drop", "home"]);
    expect(ids(moveItem(clinic, 3, 0))).toEqual(["drop", "takeoff", "corner", "clinic", "home"]);
    expect(moveItem(clinic, 0, -1)).toBe(clinic);
    expect(ids(removeItem(clinic, 1))).toEqual(["takeoff", "clinic", "drop", "home"]);
  });

  it("keep what both types have when they change their type", () => {
    const fields = new Set([
      "id",
      "latitude_deg",
      "longitude_deg",
      "relative_altitude_m",
      "absolute_altitude_m",
      "kind",
      "duration_s",
    ]);
    const plan = changeType(clinic, 1, "loiter", fields, AT);
    expect(valueAt(plan, "/items/1")).toEqual({
      id: "corner",
      type: "loiter",
      kind: "time",
      duration_s: 30,
      latitude_deg: 47.398192,
      longitude_deg: 8.546258,
      relative_altitude_m: 20,
    });
    const high = changeType(
      withValue({ items: [{ type: "takeoff" }] }, "/items/0", { type: "takeoff", absolute_altitude_m: 500 }),
      0,
      "waypoint",
      fields,
      AT,
    );
    expect(valueAt(high, "/items/0")).not.toHaveProperty("relative_altitude_m");
  });
});

describe("fences", () => {
  it("are added to whatever there is", () => {
    const ring: Point[] = [
      [8, 47],
      [8.1, 47],
      [8.1, 47.1],
    ];
    const plan = addRallyPoint(addCircle(addPolygon({}, "inclusion", ring), "exclusion", AT, 33.4), AT);
    expect(viewPlan(plan)).toMatchObject({
      fences: [{ kind: "inclusion" }, { kind: "exclusion", shape: { radius_m: 33 } }],
      rallyPoints: [AT],
    });
    expect(viewPlan(addPolygon(clinic, "exclusion", ring)).fences.length).toBe(3);
  });
});

describe("handles", () => {
  const handle = (role: HandleRole) => {
    const found = handlesOf(clinic).find((one) => one.role === role);
    if (!found) throw new Error(`no handle of role ${role}`);
    return found;
  };

  it("stand on all that has a place, by its pointer in the document", () => {
    const count = (role: HandleRole) => handlesOf(clinic).filter((one) => one.role === role).length;
    expect([
      count("item"),
      count("corner"),
      count("middle"),
      count("centre"),
      count("edge"),
      count("rally"),
      count("home"),
    ]).toEqual([2, 4, 4, 1, 1, 1, 1]);
    expect(handle("item").pointer).toBe("/items/1");
    const broken = {
      items: [null, { latitude_deg: 1 }, { latitude_deg: 1, longitude_deg: 2 }],
      geofence: { polygons: [{}], circles: ["x"] },
    };
    expect(handlesOf(broken).map(({ pointer }) => pointer)).toEqual(["/items/2"]);
  });

  it("move what they stand on and nothing else", () => {
    const plan = dragHandle(clinic, handle("item"), AT);
    expect(valueAt(plan, "/items/1")).toEqual({
      ...(valueAt(clinic, "/items/1") as object),
      latitude_deg: 47.4,
      longitude_deg: 8.55,
    });
    expect(withValue(plan, "/items/1", null)).toEqual(withValue(clinic, "/items/1", null));
  });

  it("make a corner of a middle, and a radius of an edge", () => {
    const corners = valueAt(dragHandle(clinic, handle("middle"), AT), "/geofence/polygons/0/vertices");
    expect(corners).toHaveLength(5);
    expect(valueAt(dragHandle(clinic, handle("middle"), AT), "/geofence/polygons/0/vertices/1")).toEqual({
      latitude_deg: 47.4,
      longitude_deg: 8.55,
    });
    const centre = handle("centre").at;
    expect(
      valueAt(dragHandle(clinic, handle("edge"), [centre[0], centre[1] + 0.001]), "/geofence/circles/0/radius_m"),
    ).toBe(111);
    expect(valueAt(dragHandle(clinic, handle("edge"), centre), "/geofence/circles/0/radius_m")).toBe(1);
  });
});

describe("the published schema", () => {
  const schema = planSchema();

  it("has every item type of the editor, each with its required fields in a new item", () => {
    expect(itemTypes(schema)).toEqual(ITEM_TYPES);
    for (const type of ITEM_TYPES) {
      const required = itemFields(schema, type)
        .filter((field) => field.required)
        .map(({ name }) => name);
      expect(newItem(clinic, type, 4, AT), type).toMatchObject(
        Object.fromEntries(required.map((name) => [name, expect.anything()])),
      );
      const known = new Set(["type", ...itemFields(schema, type).map(({ name }) => name)]);
      expect(
        Object.keys(newItem(clinic, type, 4, AT)).filter((name) => !known.has(name)),
        type,
      ).toEqual([]);
    }
  });

  it("has a control for every field of items, plan and shapes, but for the corners, which have a list", () => {
    const all = [
      ...ITEM_TYPES.flatMap((type) => itemFields(schema, type)),
      ...planFields(schema),
      ...(["FenceCircle", "RallyPoint", "Point", "FencePolygon"] as const).flatMap((shape) =>
        shapeFields(schema, shape),
      ),
    ];
    expect(all.filter(({ control }) => control.kind === "none").map(({ name }) => name)).toEqual(["vertices"]);
    expect(planFields(schema).map(({ name }) => name)).toEqual([
      "name",
      "vehicle_type",
      "home",
      "cruise_speed_m_s",
      "order",
      "limits",
      "contingency",
    ]);
  });
});

/** As the service publishes it, from the parts that the API's description has of it. */
function planSchema(): Record<string, unknown> {
  const text = JSON.stringify(openapi.components.schemas).replaceAll("#/components/schemas/", "#/$defs/");
  const definitions = JSON.parse(text) as Record<string, Record<string, unknown>>;
  return { ...definitions["Plan"], $defs: definitions };
}
