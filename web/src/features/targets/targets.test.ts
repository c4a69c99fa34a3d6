import { describe, expect, it } from "vitest";
import type { EventKind, StreamEvent, Target } from "../../api/types";
import { metresBetween } from "../../geo/geometry";
import { because, sampleEvent } from "../../testing/samples";
import { viewPlan } from "../plan/document";
import { courseOf, followedWords, followersOf, lastWord, motionWords, placeAfter, type ShownTarget } from "./targets";

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
    place: placeAfter(SHIP, 1),
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
    expect(metresBetween([8.55, 47.4], placeAfter(SHIP, 10))).toBeCloseTo(15, 1);
    expect(courseOf(SHIP.report)).toBeCloseTo(90);
  });

  it("has the newest word of its run", () => {
    expect(lastWord([STAYS, MOVED], "r1", "drop")).toMatchObject({ kind: "stays" });
    expect(lastWord([MOVED, STAYS], "r1", "drop")).toEqual({
      kind: "moved",
      at: [8.5502, 47.4],
      meets_at: 1020,
      from_planned_m: 15,
    });
    expect(lastWord([MOVED], "r2", "drop")).toBeNull();
  });

  it("is told in words, with its age, and says when that is too old", () => {
    expect(motionWords(shown())).toBe("Moves at 1.5 m/s towards 090°, reported 1.0 s ago.");
    expect(motionWords(shown({ age_s: 8, stale: true }))).toContain(
      "reported 8.0 s ago: too old to be followed or dropped at.",
    );
    expect(motionWords(shown({ target: null, place: null }))).toBe("Nothing was reported yet.");
    expect(followedWords(shown({ word: lastWord([MOVED], "r1", "drop") }), 1005)).toBe(
      "The waypoint was moved 15 m from where it was planned; they meet there in 15 s.",
    );
    expect(followedWords(shown({ word: lastWord([STAYS], "r1", "drop") }), 1005)).toBe(
      "The waypoint stays: the last report from ship-1 is 7 s old.",
    );
  });
});
