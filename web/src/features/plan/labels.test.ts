import { readFileSync } from "node:fs";
import { describe, expect, it } from "vitest";
import type { Timeline } from "../../api/types";
import { viewPlan } from "./document";
import {
  describeUploadObstacle,
  formatArrival,
  formatPredictedDrop,
  formatTotal,
  itemSummary,
  itemTitle,
} from "./labels";

describe("an item", () => {
  it("is told in words", () => {
    const { items } = viewPlan(
      JSON.parse(readFileSync(new URL("../../../../plans/clinic-run.json", import.meta.url), "utf8")),
    );
    expect(items.map(itemTitle)).toEqual(["Take off", "Waypoint", "Waypoint", "Gripper: release", "Return to launch"]);
    expect(items[0] && itemSummary(items[0])).toBe("15 m above home");
  });

  it("that drops while moving shows no hold", () => {
    const drop = { type: "gripper", action: "release", release_motion: "moving", hold_s: 30 };
    expect(viewPlan({ items: [drop] }).items.map(itemSummary)).toEqual(["while moving"]);
  });
});

describe("the prediction", () => {
  const entry = {
    type: "waypoint",
    visit: 1,
    seqs: [],
    start_s: 0,
    duration_s: 1,
    distance_m: 1,
    ground_speed_m_s: 5,
    latitude_deg: 0,
    longitude_deg: 0,
    relative_altitude_m: 0,
    brakes: true,
    uncertainty_s: 0,
    battery_used_percent: null,
    energy_wh: null,
  };
  const timeline: Timeline = {
    entries: [
      { ...entry, item_id: "a", end_s: 20 },
      { ...entry, item_id: "a", visit: 2, end_s: 65 },
    ],
    drops: [
      {
        item_id: "d",
        visit: 1,
        supervised: false,
        release_motion: "moving",
        at_s: 30,
        ground_speed_m_s: 15,
        relative_altitude_m: 40,
        lead_m: 25,
        offset_m: 25,
        release_latitude_deg: null,
        release_longitude_deg: null,
        fall_s: 2.8,
        throw_m: 42,
        landing_latitude_deg: null,
        landing_longitude_deg: null,
        return_battery_percent: null,
      },
    ],
    order: ["a", "a"],
    distance_m: 840,
    duration_s: 200,
    open_ended: false,
    truncated: false,
    alternates: [],
    longest_duration_s: null,
    wind: { north_m_s: 0, east_m_s: 0, given: true },
    battery_start_percent: null,
    battery_used_percent: null,
  };

  it("says when each item is done, and how often it is visited", () => {
    expect([formatArrival(timeline, "a"), formatArrival(timeline, "x"), formatArrival(null, "a")]).toEqual([
      "after 1 min 05 s (2 visits)",
      "",
      "",
    ]);
  });

  it("says how a drop will act", () => {
    expect(formatPredictedDrop(timeline, "d")).toBe(
      "embedded: 15.0 m/s at 40 m · releases 25 m before the point · falls 2.8 s, lands 42 m further",
    );
  });

  it("says where the parcel of a drop that fails goes", () => {
    const other = {
      item_id: "locker",
      drop_id: "d",
      seqs: [3],
      latitude_deg: 0,
      longitude_deg: 0,
      relative_altitude_m: 15,
      distance_m: 50,
      duration_s: 16.3,
    };
    expect(formatPredictedDrop({ ...timeline, alternates: [other] }, "d")).toMatch(
      /· if it fails: to locker, 50 m, 16 s$/,
    );
  });

  it("sums up the flight", () => {
    expect(formatTotal(timeline)).toBe("3 min 20 s · 840 m");
    expect(formatTotal({ ...timeline, battery_used_percent: 23.2 })).toBe("3 min 20 s · 840 m · 23% of the battery");
  });

  it("says that more is flown than is predicted", () => {
    const cut = { ...timeline, truncated: true, battery_used_percent: 23.2 };
    expect(formatTotal(cut)).toBe(
      "more than 3 min 20 s · more than 840 m · more than 23% of the battery · only the first 2 visits are predicted",
    );
    expect(formatArrival(cut, "a")).toBe("after 1 min 05 s (at least 2 visits)");
  });

  it("says that no wind was given", () => {
    const assumed = { ...timeline, wind: { ...timeline.wind, given: false } };
    expect(formatTotal(assumed)).toBe("3 min 20 s · 840 m · without wind");
  });
});

describe("what is in the way of an upload", () => {
  const run = { vehicle_id: "v1", state: "uploaded" } as const;

  const heard = { id: "v1", connected: true };
  const lost = { id: "v1", connected: false };

  it("is errors first, else a lost link, else the run of the vehicle, which need not be the plan on the map", () => {
    expect(describeUploadObstacle(0, null, null, null)).toBeNull();
    expect(describeUploadObstacle(0, heard, null, null)).toBeNull();
    expect(describeUploadObstacle(1, lost, run, "Clinic run")).toBe("1 error to mend before the upload.");
    expect(describeUploadObstacle(0, lost, run, "Clinic run")).toBe(
      "The link to v1 is lost. Upload the plan when the vehicle is heard again.",
    );
    expect(describeUploadObstacle(0, heard, run, "Clinic run")).toBe(
      "v1 has “Clinic run” (ready to start). Another plan can follow when that run is over.",
    );
  });
});
