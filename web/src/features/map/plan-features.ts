/** What the map shows, as GeoJSON: plan and run. Pure. */

import type { Feature, FeatureCollection, Geometry } from "geojson";
import type { Run, Timeline } from "../../api/types";
import { isAcknowledgedOnly } from "../../format/labels";
import { formatDistance } from "../../format/units";
import { circleRing, metresBetween, offset, type Point } from "../../geo/geometry";
import { alternateOf, dropPoints, isDrop, type PlanItemView, type PlanView } from "../plan/document";
import type { Handle } from "../plan/handles";
import type { Progress } from "../plan/progress";

type Properties = Record<string, string | number | boolean>;

export function collection(features: Feature[]): FeatureCollection {
  return { type: "FeatureCollection", features };
}

/**
 * One line for each leg; the leg to an item has the item's progress. The legs over an alternate are lines of their
 * own. A take-off without a position starts at home.
 */
export function pathFeatures(
  plan: PlanView,
  home: Point | null,
  progress: ReadonlyMap<string, Progress>,
): FeatureCollection {
  const legs: Feature[] = [];
  let last = home;
  let elsewhere: Point | null = null;
  const lead = (from: Point, to: Point, state: string) =>
    legs.push(feature({ type: "LineString", coordinates: [from, to] }, { state }));
  for (const item of plan.items) {
    const other = alternateOf(item)?.at ?? null;
    if (other !== null && last !== null) lead(last, other, "alternate");
    elsewhere = other ?? elsewhere;
    const to = item.type === "return_to_launch" ? home : item.at;
    if (to === null) continue;
    if (last !== null) lead(last, to, progress.get(item.id) ?? "ahead");
    if (elsewhere !== null) lead(elsewhere, to, "alternate");
    last = to;
    elsewhere = null;
  }
  return collection(legs);
}

export function placeFeatures(
  plan: PlanView,
  progress: ReadonlyMap<string, Progress>,
  pointedAt: string | null,
): FeatureCollection {
  const placed = plan.items.filter((item): item is PlanItemView & { at: Point } => item.at !== null);
  return collection(
    placed.map((item) =>
      feature(
        { type: "Point", coordinates: item.at },
        {
          id: item.id,
          label: String(item.index + 1),
          state: progress.get(item.id) ?? "ahead",
          pointed: item.id === pointedAt,
          role: "item",
          pointer: `/items/${item.index}`,
        },
      ),
    ),
  );
}

export function dropFeatures(plan: PlanView, run: Run | null): FeatureCollection {
  const places = dropPoints(plan.items);
  const outcomes = new Map(
    run?.drops.map((drop) => [drop.plan_item_id, isAcknowledgedOnly(drop) ? "unconfirmed" : drop.outcome]),
  );
  return collection(
    plan.items.filter(isDrop).flatMap((item) => {
      const other = alternateOf(item);
      return [
        { id: item.id, at: places.get(item.id) },
        { id: other?.id ?? "", at: other?.at },
      ].flatMap(({ id, at }) =>
        at
          ? feature({ type: "Point", coordinates: at }, { id, label: id, outcome: outcomes.get(id) ?? "pending" })
          : [],
      );
    }),
  );
}

export function fenceFeatures(plan: PlanView): FeatureCollection {
  return collection(
    plan.fences.map(({ kind, shape }) => {
      const ring = "ring" in shape ? shape.ring : circleRing(shape.centre, shape.radius_m);
      return feature({ type: "Polygon", coordinates: [[...ring]] }, { kind });
    }),
  );
}

/** What can be taken hold of beside the items, which are drawn as places. */
export function handleFeatures(handles: readonly Handle[]): FeatureCollection {
  const others = handles.filter(({ role }) => role !== "item");
  return collection(
    others.map(({ role, pointer, at }) => feature({ type: "Point", coordinates: at }, { role, pointer })),
  );
}

/** A fence that is not yet closed: its line and its corners. */
export function sketchFeatures(corners: readonly Point[]): FeatureCollection {
  const ends = corners.map((at) => feature({ type: "Point", coordinates: at }, {}));
  return collection(
    corners.length > 1 ? [feature({ type: "LineString", coordinates: [...corners] }, {}), ...ends] : ends,
  );
}

/** The destination of a vehicle, and the straight line to it. */
export function destinationFeatures(to: Point | null, from: Point | null): FeatureCollection {
  if (to === null) return collection([]);
  const place = feature({ type: "Point", coordinates: to }, {});
  return collection(from === null ? [place] : [feature({ type: "LineString", coordinates: [from, to] }, {}), place]);
}

/** Home and rings around it at round distances: the scale of an otherwise empty map. */
export function ringFeatures(home: Point | null, step_m: number): FeatureCollection {
  if (home === null) return collection([]);
  const features = [feature({ type: "Point", coordinates: home }, { kind: "home" })];
  for (const n of [1, 2, 3]) {
    features.push(feature({ type: "LineString", coordinates: circleRing(home, n * step_m) }, { kind: "ring" }));
    features.push(
      feature(
        { type: "Point", coordinates: offset(home, n * step_m, 45) },
        { kind: "label", label: formatDistance(n * step_m) },
      ),
    );
  }
  return collection(features);
}

function feature(geometry: Geometry, properties: Properties): Feature {
  return { type: "Feature", geometry, properties };
}

// Predicted releases as the map draws them: where the parcel leaves, how it flies on, where it comes down. Pure.

type PredictedDrop = Timeline["drops"][number];

/** Shorter ways than this are not drawn: the drop's own icon stands there. */
const VISIBLE_M = 2;

export function releaseFeatures(plan: PlanView, timeline: Timeline | null): FeatureCollection {
  const places = dropPoints(plan.items);
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
  if (metresBetween(from, target) >= VISIBLE_M)
    features.push(point(from, "release", `release ${formatDistance(drop.lead_m)} before`));
  const { landing_latitude_deg: landsLat, landing_longitude_deg: landsLon } = drop;
  if (drop.throw_m >= VISIBLE_M && landsLat !== null && landsLon !== null) {
    const lands: Point = [landsLon, landsLat];
    features.push(
      { type: "Feature", properties: { kind: "fall" }, geometry: { type: "LineString", coordinates: [from, lands] } },
      point(lands, "landing", "impact"),
    );
  }
  return features;
}

function ring(centre: Point, radius_m: number, kind: string): Feature {
  return {
    type: "Feature",
    properties: { kind },
    geometry: { type: "LineString", coordinates: circleRing(centre, radius_m) },
  };
}

function point(at: Point, kind: string, label: string): Feature {
  return { type: "Feature", properties: { kind, label }, geometry: { type: "Point", coordinates: at } };
}
