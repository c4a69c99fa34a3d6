/**
 * A task queue as the map draws it: each task's course, the ways between them, and the task that is being added. Pure.
 */

import type { Feature, FeatureCollection } from "geojson";
import type { ExpressionSpecification, FilterSpecification, LayerSpecification } from "maplibre-gl";
import type { Task, TaskOrigin, TaskPoint, TaskQueue } from "../../api/types";
import { circleRing, offset, type Point } from "../../geo/geometry";
import { labelLayout, type MapLook, ROUND } from "./look";

type State = "current" | "ahead" | "draft";

/** What is drawn of one task: a line that has a direction, and the place that has its number. */
interface Course {
  readonly line: readonly Point[];
  readonly at: Point;
  readonly corners: readonly Point[];
}

/** `draft` null: not complete yet, then only its `places` are drawn. */
export function taskFeatures(queue: TaskQueue | null, draft: Task | null, places: readonly Point[]): FeatureCollection {
  const features: Feature[] = [];
  let last: Point | null = null;
  const draw = (task: Task, label: string, state: State) => {
    const course = courseOf(task, queue?.origin ?? null);
    if (course === null) return;
    const begins = course.line[0] ?? course.at;
    if (last !== null) features.push(line([last, begins], state, "way"));
    features.push(...courseFeatures(course, label, state));
    last = course.line.at(-1) ?? course.at;
  };
  for (const [i, { task }] of queue?.tasks.entries() ?? []) draw(task, String(i + 1), i === 0 ? "current" : "ahead");
  last = null; // where the new one goes in the queue is not drawn
  if (draft !== null) draw(draft, "+", "draft");
  else features.push(...places.map((at, i) => place(at, "draft", "number", i === 0 ? "+" : "")));
  return { type: "FeatureCollection", features };
}

function courseFeatures({ line: points, at, corners }: Course, label: string, state: State): Feature[] {
  return [
    ...(points.length > 1 ? [line(points, state, "course")] : []),
    ...corners.map((corner) => place(corner, state, "corner", "")),
    place(at, state, "number", label),
  ];
}

/** Null where it counts from an origin that is not known. */
function courseOf(task: Task, origin: TaskOrigin | null): Course | null {
  switch (task.type) {
    case "goto": {
      const at = globalOf(task.point, origin);
      return at && { line: [], at, corners: [] };
    }
    case "circle": {
      const at = globalOf(task.center, origin);
      if (at === null) return null;
      const ring = circleRing(at, Math.abs(task.radius_m)); // clockwise, as bearings count
      return { line: task.radius_m > 0 ? ring : ring.reverse(), at, corners: [] };
    }
    case "segment":
      return legs([task.start, task.end], origin);
    case "path":
      return legs(task.points, origin);
  }
}

function legs(points: readonly TaskPoint[], origin: TaskOrigin | null): Course | null {
  const line = points.map((point) => globalOf(point, origin)).filter((at) => at !== null);
  const [first, ...corners] = line;
  return first === undefined || line.length < points.length ? null : { line, at: first, corners };
}

/** Local places count from the EKF origin. */
export function globalOf(point: TaskPoint, origin: TaskOrigin | null): Point | null {
  if ("latitude_deg" in point) return [point.longitude_deg, point.latitude_deg];
  if (origin === null) return null;
  const { north_m, east_m } = point;
  return offset(
    [origin.longitude_deg, origin.latitude_deg],
    Math.hypot(north_m, east_m),
    (Math.atan2(east_m, north_m) * 180) / Math.PI,
  );
}

function line(points: readonly Point[], state: State, kind: "course" | "way"): Feature {
  return { type: "Feature", properties: { state, kind }, geometry: { type: "LineString", coordinates: [...points] } };
}

function place(at: Point, state: State, kind: "number" | "corner", label: string): Feature {
  return { type: "Feature", properties: { state, kind, label }, geometry: { type: "Point", coordinates: at } };
}

// How a task queue is drawn: the current task strong, those to come lighter, the one being added dashed.

const state: ExpressionSpecification = ["get", "state"];
const current: ExpressionSpecification = ["==", state, "current"];
const source = "tasks";

function is(kind: string, ...more: ExpressionSpecification[]): FilterSpecification {
  return ["all", ["==", ["get", "kind"], kind], ...more];
}

export function taskLayers(look: MapLook): LayerSpecification[] {
  return [...courseLayers(look), ...placeLayers(look)];
}

function courseLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const width: ExpressionSpecification = ["case", current, 3.5 * scale, 2 * scale];
  return [
    {
      id: "taskWay",
      type: "line",
      source,
      filter: is("way"),
      layout: { ...ROUND },
      paint: { "line-color": p.warn, "line-width": 1.4 * scale, "line-dasharray": [1, 3], "line-opacity": 0.8 },
    },
    {
      id: "taskCasing",
      type: "line",
      source,
      filter: is("course"),
      layout: { ...ROUND },
      paint: { "line-color": p.halo, "line-width": 6 * scale, "line-opacity": 0.7 },
    },
    {
      id: "taskCourse",
      type: "line",
      source,
      filter: is("course", ["!=", state, "draft"]),
      layout: { ...ROUND },
      paint: { "line-color": p.warn, "line-width": width, "line-opacity": ["case", current, 1, 0.7] },
    },
    {
      id: "taskDraft",
      type: "line",
      source,
      filter: is("course", ["==", state, "draft"]),
      paint: { "line-color": p.text, "line-width": 2 * scale, "line-dasharray": [3, 2] },
    },
    {
      id: "taskArrow",
      type: "symbol",
      source,
      filter: is("course"),
      layout: {
        "symbol-placement": "line",
        "symbol-spacing": 70 * scale,
        "icon-image": "mark:arrow",
        "icon-size": scale,
        "icon-rotation-alignment": "map",
        "icon-allow-overlap": true,
        "icon-ignore-placement": true,
      },
    },
  ];
}

function placeLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  return [
    {
      id: "taskCorner",
      type: "circle",
      source,
      filter: is("corner"),
      paint: {
        "circle-radius": 4 * scale,
        "circle-color": p.background,
        "circle-stroke-color": ["match", state, "draft", p.text, p.warn],
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "taskPlace",
      type: "circle",
      source,
      filter: is("number"),
      paint: {
        "circle-radius": ["case", current, 11 * scale, 9 * scale],
        "circle-color": ["case", current, p.warn, p.background],
        "circle-stroke-color": ["match", state, "draft", p.text, p.warn],
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "taskNumber",
      type: "symbol",
      source,
      filter: is("number"),
      layout: { ...labelLayout("label", 11 * scale), "text-allow-overlap": true, "text-ignore-placement": true },
      paint: { "text-color": ["case", current, p.background, p.text] },
    },
  ];
}
