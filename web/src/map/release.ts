/** Predicted releases as the map draws them: where the parcel leaves, how it flies on, where it comes down. Pure. */

import type { Feature, FeatureCollection } from "geojson";
import type { Timeline } from "../api/types";
import { distance } from "../format/units";
import { dropPlaces, type PlanView } from "../plan/document";
import { circleRing, metresBetween, type Point } from "./geometry";

type PredictedDrop = Timeline["drops"][number];

/** Shorter ways than this are not drawn: the drop's own icon stands there. */
const VISIBLE_M = 2;

export function releaseFeatures(plan: PlanView, timeline: Timeline | null): FeatureCollection {
  const places = dropPlaces(plan.items);
  const features = (timeline?.drops ?? []).flatMap((drop) => {
    const target = places.get(drop.item_id);
    return target ? [...allowance(plan, drop, target), ...footprint(drop, target)] : [];
  });
  return { type: "FeatureCollection", features };
}

/** The circle outside of which the plan forbids the release. */
function allowance(plan: PlanView, drop: PredictedDrop, target: Point): Feature[] {
  const limit = plan.items.find(({ id }) => id === drop.item_id)?.fields["max_offset_m"];
  return typeof limit === "number" ? [ring(target, limit, "allowed")] : [];
}

function footprint(drop: PredictedDrop, target: Point): Feature[] {
  const { release_latitude_deg: lat, release_longitude_deg: lon } = drop;
  if (lat === null || lon === null) return drop.offset_m >= VISIBLE_M ? [ring(target, drop.offset_m, "circle")] : [];
  const from: Point = [lon, lat];
  const features: Feature[] = [];
  if (metresBetween(from, target) >= VISIBLE_M) features.push(point(from, "release", `release ${distance(drop.lead_m)} before`));
  const { landing_latitude_deg: landsLat, landing_longitude_deg: landsLon } = drop;
  if (drop.throw_m >= VISIBLE_M && landsLat !== null && landsLon !== null) {
    const lands: Point = [landsLon, landsLat];
    features.push({ type: "Feature", properties: { kind: "fall" }, geometry: { type: "LineString", coordinates: [from, lands] } }, point(lands, "landing", "comes down"));
  }
  return features;
}

function ring(centre: Point, radius_m: number, kind: string): Feature {
  return { type: "Feature", properties: { kind }, geometry: { type: "LineString", coordinates: circleRing(centre, radius_m) } };
}

function point(at: Point, kind: string, label: string): Feature {
  return { type: "Feature", properties: { kind, label }, geometry: { type: "Point", coordinates: at } };
}
