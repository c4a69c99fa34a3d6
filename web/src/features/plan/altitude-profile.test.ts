import { describe, expect, it } from "vitest";
import type { Timeline } from "../../api/types";
import { profileOf, profilePath, profileXY } from "./altitude-profile";

type Entry = Timeline["entries"][number];
type Drop = Timeline["drops"][number];

function entry(item_id: string, start_s: number, end_s: number, relative_altitude_m: number): Entry {
  return {
    item_id,
    type: "waypoint",
    visit: 1,
    seqs: [],
    start_s,
    end_s,
    duration_s: end_s - start_s,
    distance_m: 0,
    ground_speed_m_s: 5,
    latitude_deg: 0,
    longitude_deg: 0,
    relative_altitude_m,
    brakes: true,
    uncertainty_s: 0,
    battery_used_percent: null,
    energy_wh: null,
  };
}

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

function timeline(entries: Entry[], drops: Drop[] = []): Timeline {
  return {
    entries,
    drops,
    order: [],
    distance_m: 100,
    duration_s: entries.at(-1)?.end_s ?? 0,
    open_ended: false,
    truncated: false,
    alternates: [],
    longest_duration_s: null,
    wind: { north_m_s: 0, east_m_s: 0, given: true },
    battery_start_percent: null,
    battery_used_percent: null,
  };
}

describe("the altitude profile", () => {
  const profile = profileOf(
    timeline(
      [entry("a", 0, 10, 20), entry("drop", 15, 20, 20), entry("b", 20, 40, 0)],
      [drop({ at_s: 18, relative_altitude_m: 20 })],
    ),
  );

  it("begins on the ground, goes through every item, and stays level while the vehicle waits", () => {
    expect(profile?.line).toEqual([
      [0, 0],
      [10, 20],
      [15, 20],
      [20, 20],
      [40, 0],
    ]);
    expect([profile?.points.map(({ itemId }) => itemId), profile?.drops.map(({ at_s }) => at_s)]).toEqual([
      ["a", "b"],
      [18],
    ]);
    expect([profile?.low_m, profile?.high_m, profile?.end_s]).toEqual([0, 20, 40]);
  });

  it("has one mark for an item that is visited again and again", () => {
    const visits = Array.from({ length: 5_000 }, (_, i) => entry(i % 2 === 0 ? "a" : "b", i, i + 1, 20));
    expect(profileOf(timeline(visits))?.points.map(({ itemId, at_s }) => [itemId, at_s])).toEqual([
      ["a", 1],
      ["b", 2],
    ]);
  });

  it("is drawn from the lower left, with places below home below the line", () => {
    if (profile === null) throw new Error("no profile");
    expect([profileXY(profile, 0, 0), profileXY(profile, 40, 20)]).toEqual([
      [0, 1],
      [1, 0],
    ]);
    expect(profilePath(profile, 400, 100, false)).toBe("M0.0 100.0L100.0 0.0L150.0 0.0L200.0 0.0L400.0 100.0");
    expect(profilePath(profile, 400, 100, true)).toMatch(/L400\.0 100L0 100Z$/);
    expect(profileOf(timeline([entry("a", 0, 10, -20)]))).toMatchObject({ low_m: -20, high_m: 1 });
  });

  it("is not drawn when there is nothing to draw", () => {
    expect([profileOf(null), profileOf(timeline([])), profileOf(timeline([entry("a", 0, 0, 5)]))]).toEqual([
      null,
      null,
      null,
    ]);
  });
});
