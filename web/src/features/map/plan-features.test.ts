import { describe, expect, it } from "vitest";
import type { Timeline } from "../../api/types";
import { sampleDrop, sampleRun } from "../../testing/samples";
import { viewPlan } from "../plan/document";
import { itemProgress } from "../plan/progress";
import { dropFeatures, fenceFeatures, pathFeatures, releaseFeatures } from "./plan-features";

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
    const legs = pathFeatures(plan, [8, 47], itemProgress(plan, null)).features.map(
      ({ geometry }) => "coordinates" in geometry && geometry.coordinates,
    );
    expect(legs).toEqual([
      [
        [8, 47],
        [8.1, 47.1],
      ],
      [
        [8.1, 47.1],
        [8, 47],
      ],
    ]);
  });

  it("shows how far the run is", () => {
    const progress = itemProgress(plan, sampleRun({ item_id: "drop", flown_item_ids: ["up", "a"] }));
    expect([...progress.values()]).toEqual(["done", "done", "current", "ahead"]);
  });

  it("shows the return as under way until the landing, unless somebody ordered another one", () => {
    const home = { item_id: "a", flown_item_ids: ["up", "a", "drop", "back"] };
    const back = (fields: object) => itemProgress(plan, sampleRun({ ...home, ...fields })).get("back");
    expect([
      back({ state: "returning" }),
      back({ state: "completed" }),
      back({ state: "returning", commanded: "return", flown_item_ids: [] }),
    ]).toEqual(["current", "done", "ahead"]);
  });

  it("shows each drop at the position before it with its outcome", () => {
    const [feature] = dropFeatures(plan, sampleRun({ drops: [sampleDrop({ outcome: "kept" })] })).features;
    expect(feature?.geometry).toEqual({ type: "Point", coordinates: [8.1, 47.1] });
    expect(feature?.properties?.["outcome"]).toBe("kept");
  });

  it("shows the other place of a drop, the ways over it, and a run that goes there", () => {
    const locker = { id: "locker", latitude_deg: 47.2, longitude_deg: 8.2, relative_altitude_m: 10 };
    const withOther = viewPlan({
      items: plan.items.map(({ fields }) => (fields["id"] === "drop" ? { ...fields, alternate: locker } : fields)),
    });
    const legs = pathFeatures(withOther, [8, 47], itemProgress(withOther, null)).features.filter(
      ({ properties }) => properties?.["state"] === "alternate",
    );
    expect(legs.map(({ geometry }) => "coordinates" in geometry && geometry.coordinates)).toEqual([
      [
        [8.1, 47.1],
        [8.2, 47.2],
      ],
      [
        [8.2, 47.2],
        [8, 47],
      ],
    ]);
    const run = sampleRun({
      item_id: "locker",
      drops: [
        sampleDrop({ plan_item_id: "drop", outcome: "kept" }),
        sampleDrop({ plan_item_id: "locker", outcome: "pending" }),
      ],
    });
    expect(
      dropFeatures(withOther, run).features.map(({ properties }) => [properties?.["id"], properties?.["outcome"]]),
    ).toEqual([
      ["drop", "kept"],
      ["locker", "pending"],
    ]);
    expect(itemProgress(withOther, run).get("drop")).toBe("current");
  });

  it("draws its fences", () => {
    expect(fenceFeatures(plan).features[0]?.properties).toEqual({ kind: "exclusion" });
  });
});

type Drop = Timeline["drops"][number];

function drop(fields: Partial<Drop>): Drop {
  return {
    item_id: "drop",
    visit: 1,
    supervised: false,
    release_motion: "moving",
    at_s: 30,
    ground_speed_m_s: 15,
    relative_altitude_m: 40,
    lead_m: 0,
    offset_m: 0,
    release_latitude_deg: null,
    release_longitude_deg: null,
    fall_s: 3,
    throw_m: 0,
    landing_latitude_deg: null,
    landing_longitude_deg: null,
    return_battery_percent: null,
    ...fields,
  };
}

function timeline(drops: Drop[]): Timeline {
  return {
    entries: [],
    drops,
    order: [],
    distance_m: 100,
    duration_s: 0,
    open_ended: false,
    truncated: false,
    alternates: [],
    longest_duration_s: null,
    wind: { north_m_s: 0, east_m_s: 0, given: true },
    battery_start_percent: null,
    battery_used_percent: null,
  };
}

describe("a predicted release", () => {
  const plan = viewPlan({
    items: [
      { type: "waypoint", latitude_deg: 47.39, longitude_deg: 8.5 },
      { type: "waypoint", latitude_deg: 47.4, longitude_deg: 8.5 },
      { id: "drop", type: "gripper", max_offset_m: 30 },
    ],
  });
  const drawn = (fields: Partial<Drop>) => releaseFeatures(plan, timeline([drop(fields)])).features;
  const kinds = (fields: Partial<Drop>) => drawn(fields).map(({ properties }) => properties?.["kind"]);

  it("shows where the parcel leaves before the point, its way, and where it comes down", () => {
    const lands = { landing_latitude_deg: 47.4003, landing_longitude_deg: 8.5, throw_m: 67 };
    const early = { release_latitude_deg: 47.3997, release_longitude_deg: 8.5, lead_m: 33, offset_m: 33, ...lands };
    expect(kinds(early)).toEqual(["allowed", "release", "fall", "landing"]);
    expect(drawn(early)[3]?.geometry).toEqual({ type: "Point", coordinates: [8.5, 47.4003] });
  });

  it("that the wind alone moves has no release of its own", () => {
    const blown = { landing_latitude_deg: 47.4, landing_longitude_deg: 8.5002, throw_m: 15 };
    expect(kinds({ release_latitude_deg: 47.4, release_longitude_deg: 8.5, ...blown })).toEqual([
      "allowed",
      "fall",
      "landing",
    ]);
  });

  it("is the circle on which it may happen, and nothing at all without a prediction", () => {
    expect(kinds({ offset_m: 80 })).toEqual(["allowed", "circle"]);
    expect(kinds({})).toEqual(["allowed"]);
    expect(releaseFeatures(plan, null).features).toEqual([]);
  });
});
