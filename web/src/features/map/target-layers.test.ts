import { expect, it } from "vitest";
import type { Target } from "../../api/types";
import { positionAfter, type ShownTarget, type TargetUpdate } from "../targets/targets";
import { targetFeatures } from "./target-layers";

const SHIP: Target = {
  feed: "ship-1",
  report: { latitude_deg: 47.4, longitude_deg: 8.55, north_m_s: 0, east_m_s: 1.5, time: 1000 },
  age_s: 0.4,
  stale: false,
};
const MOVED: TargetUpdate = { kind: "moved", at: [8.5502, 47.4], meets_at: 1020, from_planned_m: 15 };

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
const kinds = (one: ShownTarget, now: number | null) =>
  targetFeatures([one], now).features.map(({ properties }) => properties?.["kind"]);

it("draws a target with its way to the meeting, none when it is stale, and its bound alone when it is unseen", () => {
  expect(kinds(shown({ word: MOVED }), 1005)).toEqual(["bound", "way", "meet", "target"]);
  expect(kinds(shown({ word: MOVED }), 1021)).toEqual(["bound", "way", "target"]);
  expect(kinds(shown({ stale: true }), 1005)).toEqual(["bound", "stale"]);
  expect(kinds(shown({ target: null, place: null }), 1005)).toEqual(["bound"]);
});
