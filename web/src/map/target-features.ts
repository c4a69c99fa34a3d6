/** Moving targets as the map draws them: where each is by now, its way on, where it is met, and how far a waypoint may move. Pure. */

import type { Feature, FeatureCollection, Geometry } from "geojson";
import type { ShownTarget } from "../state/targets";
import { placeAfter } from "../targets/following";
import { circleRing } from "./geometry";

/** Of its way, where no meeting is known. */
const AHEAD_S = 30;

/** `now` in Unix seconds; null if the service's time is not known. */
export function targetFeatures(shown: readonly ShownTarget[] | null, now: number | null): FeatureCollection {
  return { type: "FeatureCollection", features: (shown ?? []).flatMap((one) => featuresOf(one, now)) };
}

function featuresOf({ follower, target, age_s, stale, place, word }: ShownTarget, now: number | null): Feature[] {
  const bound = follower === null || follower.planned === null || follower.max_move_m === null ? [] : [feature("bound", { type: "LineString", coordinates: circleRing(follower.planned, follower.max_move_m) })];
  if (target === null || place === null) return bound;
  const meets = word?.kind === "moved" && now !== null && word.meets_at > now ? word : null;
  const ahead_s = meets === null || now === null ? AHEAD_S : meets.meets_at - now;
  const way = stale ? [] : [feature("way", { type: "LineString", coordinates: [place, placeAfter(target, age_s + ahead_s)] })];
  const met = meets === null || stale ? [] : [feature("meet", { type: "Point", coordinates: meets.at }, "meeting")];
  return [...bound, ...way, ...met, feature(stale ? "stale" : "target", { type: "Point", coordinates: place }, target.feed)];
}

function feature(kind: string, geometry: Geometry, label = ""): Feature {
  return { type: "Feature", geometry, properties: { kind, label } };
}
