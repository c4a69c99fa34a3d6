/** A task that is being put together: places from the map, and a form. Pure. */

import type { InsertMode, Task, TaskPoint, WhenEmpty } from "../../api/types";
import { metresBetween, type Point } from "../../geo/geometry";
import type { TargetMotion } from "../targets/targets";

export const TASK_KINDS = ["goto", "circle", "segment", "path"] as const;
export type TaskKind = (typeof TASK_KINDS)[number];

/** How many places a kind needs, and how many it takes. */
export const POINT_COUNTS: Readonly<Record<TaskKind, readonly [least: number, most: number]>> = {
  goto: [1, 1],
  circle: [1, 1],
  segment: [2, 2],
  path: [1, 5],
};

export interface TaskForm {
  /** Above home; null: as high as the vehicle is when the task begins. */
  readonly altitude_m: number | null;
  /** Null: the vehicle's own. */
  readonly speed_m_s: number | null;
  /** Null: no limit. */
  readonly duration_s: number | null;
  readonly radius_m: number | null;
  readonly clockwise: boolean;
  readonly stay: boolean;
  readonly gripper: "release" | "grab" | null;
  /** The target that a goto follows, by its feed; null: it goes to a place. */
  readonly follow: string | null;
  readonly insert: InsertMode;
  readonly whenEmpty: WhenEmpty;
}

export type NumericField = "altitude_m" | "speed_m_s" | "duration_s" | "radius_m";

/** `wait`: on this page nothing continues without the pilot. */
export const DEFAULT_FORM: TaskForm = {
  altitude_m: null,
  speed_m_s: null,
  duration_s: null,
  radius_m: 20,
  clockwise: true,
  stay: false,
  gripper: null,
  follow: null,
  insert: "append",
  whenEmpty: "wait",
};

/** The smallest circle that the service takes for a wing, and the usual one. */
export const WING_RADIUS_M = { least: 30, usual: 80 } as const;

/** A wing flies its own speed, and cannot stop for a gripper. */
export function defaultForm(isWing: boolean): TaskForm {
  return isWing ? { ...DEFAULT_FORM, radius_m: WING_RADIUS_M.usual } : DEFAULT_FORM;
}

/** Places nearer than this are one: a double click makes two. */
const SAME_PLACE_M = 0.3;

/** One place more; where no more are taken, the last one goes there. */
export function addPoint(kind: TaskKind, places: readonly Point[], at: Point): readonly Point[] {
  const last = places.at(-1);
  if (last !== undefined && metresBetween(last, at) < SAME_PLACE_M) return places;
  return [...(places.length < POINT_COUNTS[kind][1] ? places : places.slice(0, -1)), at];
}

export function isComplete(kind: TaskKind, places: readonly Point[]): boolean {
  return places.length >= POINT_COUNTS[kind][0];
}

/** The target that is followed instead of a place; null: none. */
export const followedFeed = (kind: TaskKind, form: TaskForm): string | null => (kind === "goto" ? form.follow : null);

/**
 * The task as the service takes it; null while something is missing. `target`: what is followed, null if nothing is
 * known.
 */
export function buildTask(
  kind: TaskKind,
  places: readonly Point[],
  form: TaskForm,
  target: TargetMotion | null = null,
): Task | null {
  const points = places.map(pointOf);
  const [first, second] = points;
  const common = {
    relative_altitude_m: form.altitude_m,
    absolute_altitude_m: null,
    speed_m_s: form.speed_m_s,
    duration_s: form.duration_s ?? -1,
  };
  if (followedFeed(kind, form) !== null)
    return target && { ...common, ...target, type: "goto", stay: false, yaw_deg: null, gripper: null };
  if (!isComplete(kind, places) || first === undefined) return null;
  switch (kind) {
    case "goto":
      return {
        ...common,
        type: "goto",
        point: first,
        stay: form.stay && form.gripper === null,
        yaw_deg: null,
        gripper: form.gripper,
        motion: null,
      };
    case "circle":
      return form.radius_m === null
        ? null
        : { ...common, type: "circle", center: first, radius_m: form.clockwise ? form.radius_m : -form.radius_m };
    case "segment":
      return second === undefined ? null : { ...common, type: "segment", start: first, end: second };
    case "path":
      return { ...common, type: "path", points };
  }
}

function pointOf([longitude_deg, latitude_deg]: Point): TaskPoint {
  return { latitude_deg, longitude_deg };
}
