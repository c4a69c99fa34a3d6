import { describe, expect, it } from "vitest";
import { viewPlan } from "../plan/document";
import { sampleDrop, sampleRun } from "../testing/samples";
import { boundsAround } from "./camera";
import { dropFeatures, fenceFeatures, itemProgress, pathFeatures } from "./features";
import { circleRing, metresBetween, offset } from "./geometry";
import { degreeLabel, graticule, type View } from "./graticule";
import { gridLabels } from "./grid-labels";

const VIEW: View = { west: 8.54, south: 47.39, east: 8.56, north: 47.4, width_px: 800, height_px: 600 };

describe("geometry", () => {
  it("measures a degree of latitude", () => {
    expect(metresBetween([8, 47], [8, 48])).toBeCloseTo(111_195, -1);
  });

  it("draws a circle whose points all have the radius", () => {
    const ring = circleRing([8, 47], 250);
    for (const point of ring) expect(metresBetween([8, 47], point)).toBeCloseTo(250, 0);
    expect(ring[0]?.map((x) => x.toFixed(9))).toEqual(ring.at(-1)?.map((x) => x.toFixed(9)));
  });

  it("goes clockwise from north", () => {
    expect(offset([8, 47], 100, 90)[0]).toBeGreaterThan(8);
  });
});

describe("the graticule", () => {
  it("covers the view and a margin, with lines neither crowded nor rare at every zoom", () => {
    for (const span of [1e-4, 1e-3, 0.02, 0.3, 5, 90, 360]) {
      const view = { ...VIEW, west: -span / 2, east: span / 2, south: -span / 3, north: span / 3 };
      const { step_deg, major, minor } = graticule(view);
      const spacing_px = (step_deg / span) * view.width_px;
      expect(spacing_px, `span ${span}`).toBeGreaterThan(40);
      expect(spacing_px, `span ${span}`).toBeLessThan(120);
      expect(major.length + minor.length).toBeLessThan(200);
    }
  });

  it("labels its lines with the decimals of its step", () => {
    expect(degreeLabel(8.545, 0.001, "EW")).toBe("8.545° E");
    expect(degreeLabel(-47.4, 0.01, "NS")).toBe("47.40° S");
    expect(degreeLabel(0, 10, "EW")).toBe("0°");
  });

  it("puts no label into the corners of the map", () => {
    const grid = graticule(VIEW);
    const project = ([lon, lat]: [number, number]) => ({ x: ((lon - VIEW.west) / 0.02) * 800, y: ((VIEW.north - lat) / 0.01) * 600 });
    const labels = gridLabels(grid, VIEW, project);
    expect(labels.length).toBeGreaterThan(0);
    for (const { edge, at_px } of labels) {
      expect(at_px).toBeGreaterThan(30);
      expect(at_px).toBeLessThan((edge === "top" ? 800 : 600) - 30);
    }
  });
});

describe("bounds", () => {
  it("of one parked vehicle leave room around it, and of nothing there are none", () => {
    const bounds = boundsAround([[8, 47]]);
    expect(bounds && metresBetween([bounds[0], 47], [bounds[2], 47])).toBeGreaterThan(100);
    expect(boundsAround([])).toBeNull();
  });
});

describe("a plan on the map", () => {
  const plan = viewPlan({
    items: [
      { id: "up", type: "takeoff", relative_altitude_m: 10 },
      { id: "a", type: "waypoint", latitude_deg: 47.1, longitude_deg: 8.1, relative_altitude_m: 10 },
      { id: "drop", type: "gripper", action: "release" },
      { id: "back", type: "return_to_launch" },
    ],
    geofence: { circles: [{ kind: "exclusion", latitude_deg: 47, longitude_deg: 8, radius_m: 20 }] },
  });

  it("begins and ends at home", () => {
    const legs = pathFeatures(plan, [8, 47], itemProgress(plan, null)).features.map(({ geometry }) => "coordinates" in geometry && geometry.coordinates);
    expect(legs).toEqual([
      [[8, 47], [8.1, 47.1]],
      [[8.1, 47.1], [8, 47]],
    ]);
  });

  it("shows how far the run is", () => {
    const progress = itemProgress(plan, sampleRun({ item_id: "drop", flown_item_ids: ["up", "a"] }));
    expect([...progress.values()]).toEqual(["done", "done", "current", "ahead"]);
  });

  it("shows the return as under way until the landing, unless somebody ordered another one", () => {
    const home = { item_id: "a", flown_item_ids: ["up", "a", "drop", "back"] };
    const back = (fields: object) => itemProgress(plan, sampleRun({ ...home, ...fields })).get("back");
    expect([back({ state: "returning" }), back({ state: "completed" }), back({ state: "returning", asked: "return", flown_item_ids: [] })]).toEqual(["current", "done", "ahead"]);
  });

  it("shows each drop at the position before it with its outcome", () => {
    const [feature] = dropFeatures(plan, sampleRun({ drops: [sampleDrop({ outcome: "kept" })] })).features;
    expect(feature?.geometry).toEqual({ type: "Point", coordinates: [8.1, 47.1] });
    expect(feature?.properties?.["outcome"]).toBe("kept");
  });

  it("shows the other place of a drop, the ways over it, and a run that goes there", () => {
    const locker = { id: "locker", latitude_deg: 47.2, longitude_deg: 8.2, relative_altitude_m: 10 };
    const withOther = viewPlan({ items: plan.items.map(({ fields }) => (fields["id"] === "drop" ? { ...fields, alternate: locker } : fields)) });
    const legs = pathFeatures(withOther, [8, 47], itemProgress(withOther, null)).features.filter(({ properties }) => properties?.["state"] === "alternate");
    expect(legs.map(({ geometry }) => "coordinates" in geometry && geometry.coordinates)).toEqual([
      [[8.1, 47.1], [8.2, 47.2]],
      [[8.2, 47.2], [8, 47]],
    ]);
    const run = sampleRun({ item_id: "locker", drops: [sampleDrop({ plan_item_id: "drop", outcome: "kept" }), sampleDrop({ plan_item_id: "locker", outcome: "pending" })] });
    expect(dropFeatures(withOther, run).features.map(({ properties }) => [properties?.["id"], properties?.["outcome"]])).toEqual([["drop", "kept"], ["locker", "pending"]]);
    expect(itemProgress(withOther, run).get("drop")).toBe("current");
  });

  it("draws its fences", () => {
    expect(fenceFeatures(plan).features[0]?.properties).toEqual({ kind: "exclusion" });
  });
});
