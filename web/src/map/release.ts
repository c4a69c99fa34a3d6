/** Predicted releases as the map draws them: where the parcel leaves, how it flies on, where it comes down. Pure. */

import type { Feature, FeatureCollection } from "geojson";
import type { Timeline } from "../api/types";
import { distance } from "../format/units";
import { dropPlaces, type PlanView } from "../plan/document";
import { circleRing, metresBetween, offset, type Point } from "./geometry";

type PredictedDrop = Timeline["drops"][number];

/** Shorter ways than this are not drawn: the drop's own icon stands there. */
const VISIBLE_M = 2;

export function releaseFeatures(plan: PlanView, timeline: Timeline | null): FeatureCollection {
  const places = dropPlaces(plan.items);
  const features = (timeline?.drops ?? []).flatMap((drop) => {
    const target = places.get(drop.item_id);
    return target ? [...allowance(plan, drop, target), ...footprint(plan, drop, target)] : [];
  });
  return { type: "FeatureCollection", features };
}

/** The circle outside of which the plan forbids the release. */
function allowance(plan: PlanView, drop: PredictedDrop, target: Point): Feature[] {
  const limit = plan.items.find(({ id }) => id === drop.item_id)?.fields["max_offset_m"];
  return typeof limit === "number" ? [ring(target, limit, "allowed")] : [];
}

function footprint(plan: PlanView, drop: PredictedDrop, target: Point): Feature[] {
  const { release_latitude_deg: lat, release_longitude_deg: lon } = drop;
  if (lat === null || lon === null) return drop.offset_m >= VISIBLE_M ? [ring(target, drop.offset_m, "circle")] : [];
  const from: Point = [lon, lat];
  const features: Feature[] = [];
  if (metresBetween(from, target) >= VISIBLE_M) features.push(point(from, "release", `release ${distance(drop.lead_m)} before`));
  if (drop.throw_m >= VISIBLE_M) {
    const lands = offset(from, drop.throw_m, track(plan, drop, from, target));
    features.push({ type: "Feature", properties: { kind: "fall" }, geometry: { type: "LineString", coordinates: [from, lands] } }, point(lands, "landing", "comes down"));
  }
  return features;
}

/** The course over the point: towards it from where the release is, else from the place before. */
function track(plan: PlanView, drop: PredictedDrop, from: Point, target: Point): number {
  if (metresBetween(from, target) >= VISIBLE_M) return bearing(from, target);
  const index = plan.items.findIndex(({ id }) => id === drop.item_id);
  const places = plan.items.slice(0, index).flatMap(({ at }) => (at === null ? [] : [at]));
  const before = places.at(-2) ?? plan.home;
  return before ? bearing(before, target) : 0;
}

function bearing([lon1, lat1]: Point, [lon2, lat2]: Point): number {
  const east = (lon2 - lon1) * Math.cos((lat1 * Math.PI) / 180);
  return (Math.atan2(east, lat2 - lat1) * 180) / Math.PI;
}

function ring(centre: Point, radius_m: number, kind: string): Feature {
  return { type: "Feature", properties: { kind }, geometry: { type: "LineString", coordinates: circleRing(centre, radius_m) } };
}

function point(at: Point, kind: string, label: string): Feature {
  return { type: "Feature", properties: { kind, label }, geometry: { type: "Point", coordinates: at } };
}
