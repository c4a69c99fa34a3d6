/**
 * Moving targets as the map draws them: where each is by now, its way on, where it is met, and how far a waypoint may
 * move. Pure.
 */

import type { Feature, FeatureCollection, Geometry } from "geojson";
import type { ExpressionSpecification, FilterSpecification, LayerSpecification } from "maplibre-gl";
import { circleRing } from "../../geo/geometry";
import { positionAfter, type ShownTarget } from "../targets/targets";
import { labelLayout, labelPaint, type MapLook, ROUND } from "./look";

/** Of its way, where no meeting is known. */
const AHEAD_S = 30;

/** `now` in Unix seconds; null if the service's time is not known. */
export function targetFeatures(shown: readonly ShownTarget[] | null, now: number | null): FeatureCollection {
  return { type: "FeatureCollection", features: (shown ?? []).flatMap((one) => featuresOf(one, now)) };
}

function featuresOf({ follower, target, age_s, stale, place, word }: ShownTarget, now: number | null): Feature[] {
  const bound =
    follower === null || follower.planned === null || follower.max_move_m === null
      ? []
      : [feature("bound", { type: "LineString", coordinates: circleRing(follower.planned, follower.max_move_m) })];
  if (target === null || place === null) return bound;
  const meets = word?.kind === "moved" && now !== null && word.meets_at > now ? word : null;
  const ahead_s = meets === null || now === null ? AHEAD_S : meets.meets_at - now;
  const way = stale
    ? []
    : [feature("way", { type: "LineString", coordinates: [place, positionAfter(target, age_s + ahead_s)] })];
  const met =
    meets === null || stale ? [] : [feature("meet", { type: "Point", coordinates: meets.at }, "meeting point")];
  return [
    ...bound,
    ...way,
    ...met,
    feature(stale ? "stale" : "target", { type: "Point", coordinates: place }, target.feed),
  ];
}

function feature(kind: string, geometry: Geometry, label = ""): Feature {
  return { type: "Feature", geometry, properties: { kind, label } };
}

// How a moving target is drawn: a square where it is by now, dashes where it goes, a ring where it is met.

export function targetLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const kind: ExpressionSpecification = ["get", "kind"];
  const is = (...kinds: string[]): FilterSpecification => ["in", kind, ["literal", kinds]];
  const source = "targets";
  const colour: ExpressionSpecification = ["match", kind, "stale", p.vehicleStale, p.drop];
  return [
    {
      id: "targetBound",
      type: "line",
      source,
      filter: is("bound"),
      layout: { ...ROUND },
      paint: { "line-color": p.drop, "line-width": 1.4 * scale, "line-dasharray": [4, 3], "line-opacity": 0.6 },
    },
    {
      id: "targetWay",
      type: "line",
      source,
      filter: is("way"),
      layout: { ...ROUND },
      paint: { "line-color": p.drop, "line-width": 2.4 * scale, "line-dasharray": [0.5, 2] },
    },
    {
      id: "targetMeet",
      type: "circle",
      source,
      filter: is("meet"),
      paint: {
        "circle-radius": 13 * scale,
        "circle-opacity": 0,
        "circle-stroke-color": p.drop,
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "targetIcon",
      type: "symbol",
      source,
      filter: is("target", "stale"),
      layout: { "icon-image": ["concat", "target:", kind], "icon-size": scale, "icon-allow-overlap": true },
    },
    {
      id: "targetText",
      type: "symbol",
      source,
      filter: is("target", "stale", "meet"),
      layout: {
        ...labelLayout("label", 12 * scale),
        "text-anchor": "top",
        "text-offset": [0, 1.1],
        "text-optional": true,
      },
      paint: { ...labelPaint(p.text, p), "text-color": colour },
    },
  ];
}
