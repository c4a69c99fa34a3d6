/** What the map shows, as GeoJSON: plan, run, tracks. Pure. */

import type { Feature, FeatureCollection, Geometry } from "geojson";
import type { Run, RunState } from "../api/types";
import { distance } from "../format/units";
import { restsOnAckAlone } from "../format/words";
import { alternateOf, dropPlaces, isDrop, type PlanItemView, type PlanView } from "../plan/document";
import type { Handle } from "../plan/handles";
import { trackLines, type Tracks } from "../state/tracks";
import { circleRing, offset, type Point } from "./geometry";

type Properties = Record<string, string | number | boolean>;

export function collection(features: Feature[]): FeatureCollection {
  return { type: "FeatureCollection", features };
}

/** A heartbeat older than this is shown as stale, before the service calls the link lost. */
export const STALE_S = 2.5;

export function trackFeatures(tracks: Tracks): FeatureCollection {
  return collection(Object.entries(tracks).map(([id, track]) => feature({ type: "MultiLineString", coordinates: trackLines(track) }, { id })));
}

export type Progress = "ahead" | "current" | "done";

/** How far a run is with each item of its plan; without a run all is ahead. */
export function itemProgress(plan: PlanView, run: Run | null): Map<string, Progress> {
  const done = new Set(run?.flown_item_ids ?? []);
  const current = run === null ? null : currentItem(plan, run);
  const isCurrent = (item: PlanItemView) => current !== null && (item.id === current || alternateOf(item)?.id === current); // at its other place
  return new Map(plan.items.map((item) => [item.id, isCurrent(item) ? "current" : done.has(item.id) ? "done" : "ahead"]));
}

const IN_MISSION: ReadonlySet<RunState> = new Set(["starting", "flying", "at_drop", "paused"]);

/** The item under way. For the vehicle a return is done as soon as it begins; for people it lasts until the landing. */
function currentItem(plan: PlanView, run: Run): string | null {
  if (run.state === "returning") return run.asked === null ? (plan.items.find(({ type }) => type === "return_to_launch")?.id ?? null) : null;
  return IN_MISSION.has(run.state) ? run.item_id : null;
}

/** One line for each leg; the leg to an item has the item's progress. The legs over an alternate are lines of their own. A take-off without a position starts at home. */
export function pathFeatures(plan: PlanView, home: Point | null, progress: ReadonlyMap<string, Progress>): FeatureCollection {
  const legs: Feature[] = [];
  let last = home;
  let elsewhere: Point | null = null;
  const lead = (from: Point, to: Point, state: string) => legs.push(feature({ type: "LineString", coordinates: [from, to] }, { state }));
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

export function placeFeatures(plan: PlanView, progress: ReadonlyMap<string, Progress>, pointedAt: string | null): FeatureCollection {
  const placed = plan.items.filter((item): item is PlanItemView & { at: Point } => item.at !== null);
  return collection(
    placed.map((item) =>
      feature({ type: "Point", coordinates: item.at }, {
        id: item.id,
        label: String(item.index + 1),
        state: progress.get(item.id) ?? "ahead",
        pointed: item.id === pointedAt,
        role: "item",
        pointer: `/items/${item.index}`,
      }),
    ),
  );
}

export function dropFeatures(plan: PlanView, run: Run | null): FeatureCollection {
  const places = dropPlaces(plan.items);
  const outcomes = new Map(run?.drops.map((drop) => [drop.plan_item_id, restsOnAckAlone(drop) ? "unconfirmed" : drop.outcome]));
  return collection(
    plan.items.filter(isDrop).flatMap((item) => {
      const other = alternateOf(item);
      return [{ id: item.id, at: places.get(item.id) }, { id: other?.id ?? "", at: other?.at }].flatMap(({ id, at }) =>
        at ? feature({ type: "Point", coordinates: at }, { id, label: id, outcome: outcomes.get(id) ?? "pending" }) : [],
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
  return collection(others.map(({ role, pointer, at }) => feature({ type: "Point", coordinates: at }, { role, pointer })));
}

/** A fence that is not yet closed: its line and its corners. */
export function sketchFeatures(corners: readonly Point[]): FeatureCollection {
  const ends = corners.map((at) => feature({ type: "Point", coordinates: at }, {}));
  return collection(corners.length > 1 ? [feature({ type: "LineString", coordinates: [...corners] }, {}), ...ends] : ends);
}

/** Where a vehicle was told to go, and the straight way there. */
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
    features.push(feature({ type: "Point", coordinates: offset(home, n * step_m, 45) }, { kind: "label", label: distance(n * step_m) }));
  }
  return collection(features);
}

function feature(geometry: Geometry, properties: Properties): Feature {
  return { type: "Feature", geometry, properties };
}
