/** A task queue as the map draws it: each task's course, the ways between them, and the task that is being added. Pure. */

import type { Feature, FeatureCollection } from "geojson";
import type { Task, TaskOrigin, TaskPoint, TaskQueue } from "../api/types";
import { circleRing, offset, type Point } from "./geometry";

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
  queue?.tasks.forEach(({ task }, i) => draw(task, String(i + 1), i === 0 ? "current" : "ahead"));
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
  return offset([origin.longitude_deg, origin.latitude_deg], Math.hypot(north_m, east_m), (Math.atan2(east_m, north_m) * 180) / Math.PI);
}

function line(points: readonly Point[], state: State, kind: "course" | "way"): Feature {
  return { type: "Feature", properties: { state, kind }, geometry: { type: "LineString", coordinates: [...points] } };
}

function place(at: Point, state: State, kind: "number" | "corner", label: string): Feature {
  return { type: "Feature", properties: { state, kind, label }, geometry: { type: "Point", coordinates: at } };
}
