import { describe, expect, it } from "vitest";
import type { EventKind, StreamEvent, Target } from "../../api/types";
import { metresBetween } from "../../geo/geometry";
import { because, sampleEvent } from "../../testing/samples";
import { viewPlan } from "../plan/document";
import {
  describeFollowing,
  describeMotion,
  followersOf,
  lastUpdate,
  positionAfter,
  type ShownTarget,
  targetCourse,
} from "./targets";

const DECK = { type: "waypoint", id: "deck", latitude_deg: 47.4, longitude_deg: 8.55 };
const DROP = { type: "gripper", id: "drop", target: { feed: "ship-1", max_move_m: 40, max_speed_m_s: 2 } };
const SHIP: Target = {
  feed: "ship-1",
  report: { latitude_deg: 47.4, longitude_deg: 8.55, north_m_s: 0, east_m_s: 1.5, time: 1000 },
  age_s: 0.4,
  stale: false,
};

function event(kind: EventKind, data: object): StreamEvent {
  return sampleEvent(1, { kind, time: 1000, vehicle_id: "v1", run_id: "r1", data: { plan_item_id: "drop", ...data } });
}
const MOVED = event("run.target_moved", {
  moved_to: { latitude_deg: 47.4, longitude_deg: 8.5502 },
  after_s: 20,
  from_planned_m: 15,
});
const STAYS = event("run.target_not_followed", { reason: because("target.stale", { feed: "ship-1", age_s: 7 }) });

function shown(fields: Partial<ShownTarget> = {}): ShownTarget {
  const follower = { dropId: "drop", feed: "ship-1", planned: [8.55, 47.4] as [number, number], max_move_m: 40 };
  return {
    follower,
    feed: "ship-1",
    target: SHIP,
    age_s: 1,
    stale: false,
    place: positionAfter(SHIP, 1),
    word: null,
    ...fields,
  };
}

describe("a moving target", () => {
  it("belongs to the drop that names its feed, around the place that was planned first", () => {
    expect(followersOf(viewPlan({ items: [DECK, DROP, { type: "gripper", id: "other" }] }))).toEqual([
      { dropId: "drop", feed: "ship-1", planned: [8.55, 47.4], max_move_m: 40 },
    ]);
    const planned = { latitude_deg: 47.5, longitude_deg: 8.6 };
    expect(
      followersOf(viewPlan({ items: [DECK, { ...DROP, target: { ...DROP.target, planned } }] }))[0]?.planned,
    ).toEqual([8.6, 47.5]);
  });

  it("is where it would be by now", () => {
    expect(metresBetween([8.55, 47.4], positionAfter(SHIP, 10))).toBeCloseTo(15, 1);
    expect(targetCourse(SHIP.report)).toBeCloseTo(90);
  });

  it("has the newest word of its run", () => {
    expect(lastUpdate([STAYS, MOVED], "r1", "drop")).toMatchObject({ kind: "stays" });
    expect(lastUpdate([MOVED, STAYS], "r1", "drop")).toEqual({
      kind: "moved",
      at: [8.5502, 47.4],
      meets_at: 1020,
      from_planned_m: 15,
    });
    expect(lastUpdate([MOVED], "r2", "drop")).toBeNull();
  });

  it("is told in words, with its age, and says when that is too old", () => {
    expect(describeMotion(shown())).toBe("Moves at 1.5 m/s towards 090°, reported 1.0 s ago.");
    expect(describeMotion(shown({ age_s: 8, stale: true }))).toContain(
      "reported 8.0 s ago: too old to follow or drop at.",
    );
    expect(describeMotion(shown({ target: null, place: null }))).toBe("No report yet.");
    expect(describeFollowing(shown({ word: lastUpdate([MOVED], "r1", "drop") }), 1005)).toBe(
      "The waypoint moved 15 m from its planned position; meeting in 15 s.",
    );
    expect(describeFollowing(shown({ word: lastUpdate([STAYS], "r1", "drop") }), 1005)).toBe(
      "The waypoint stays: the last report from ship-1 is 7 s old.",
    );
  });
});
