/** What of a plan can be taken hold of on the map, and what dragging it does. Pure. */

import type { PlanDocument } from "../../api/types";
import { metresBetween, offset, type Point } from "../../geo/geometry";
import { pointFields, round } from "./edits";
import { isRecord, valueAt, withEntry, withValue } from "./pointer";

/** `middle` makes a new corner of a fence, `edge` sets a circle's radius; all others move what they stand on. */
export type HandleRole = "item" | "approach" | "alternate" | "corner" | "middle" | "centre" | "edge" | "rally" | "home";

export interface Handle {
  readonly role: HandleRole;
  /** Of what it changes; of a middle: of the corner before it. */
  readonly pointer: string;
  readonly at: Point;
}

export function handlesOf(plan: PlanDocument): Handle[] {
  return [
    ...listAt(plan, "/geofence/polygons").flatMap((_, i) => polygonHandles(plan, `/geofence/polygons/${i}/vertices`)),
    ...listAt(plan, "/geofence/circles").flatMap((circle, i) => circleHandles(circle, `/geofence/circles/${i}`)),
    ...placed(plan, "rally", "/rally_points"),
    ...placed(plan, "item", "/items"),
    ...listAt(plan, "/items").flatMap((_, i) => placedAt(plan, "approach", `/items/${i}/approach`)),
    ...listAt(plan, "/items").flatMap((_, i) => placedAt(plan, "alternate", `/items/${i}/alternate`)),
    ...placedAt(plan, "home", "/home"),
  ];
}

/** The plan as it was when the drag began, with the handle dragged to a place. */
export function dragHandle(plan: PlanDocument, handle: Handle, at: Point): PlanDocument {
  switch (handle.role) {
    case "edge": {
      const centre = pointOf(valueAt(plan, handle.pointer));
      return centre === null
        ? plan
        : withValue(plan, `${handle.pointer}/radius_m`, Math.max(1, round(metresBetween(centre, at), 0)));
    }
    case "middle": {
      const cut = handle.pointer.lastIndexOf("/");
      return withEntry(plan, handle.pointer.slice(0, cut), Number(handle.pointer.slice(cut + 1)) + 1, pointFields(at));
    }
    default: {
      const old = valueAt(plan, handle.pointer);
      return isRecord(old) ? withValue(plan, handle.pointer, { ...old, ...pointFields(at) }) : plan;
    }
  }
}

function polygonHandles(plan: PlanDocument, pointer: string): Handle[] {
  const corners = placed(plan, "corner", pointer);
  if (corners.length < 3) return corners;
  const middles = corners.map(({ pointer: before, at }, i): Handle => {
    const next = corners[(i + 1) % corners.length]?.at ?? at;
    return { role: "middle", pointer: before, at: [(at[0] + next[0]) / 2, (at[1] + next[1]) / 2] };
  });
  return [...middles, ...corners];
}

function circleHandles(circle: unknown, pointer: string): Handle[] {
  const centre = pointOf(circle);
  const radius_m = isRecord(circle) ? circle["radius_m"] : null;
  if (centre === null || typeof radius_m !== "number") return [];
  return [
    { role: "centre", pointer, at: centre },
    { role: "edge", pointer, at: offset(centre, radius_m, 90) },
  ];
}

function placed(plan: PlanDocument, role: HandleRole, pointer: string): Handle[] {
  return listAt(plan, pointer).flatMap((_, i) => placedAt(plan, role, `${pointer}/${i}`));
}

function placedAt(plan: PlanDocument, role: HandleRole, pointer: string): Handle[] {
  const at = pointOf(valueAt(plan, pointer));
  return at === null ? [] : [{ role, pointer, at }];
}

function listAt(plan: PlanDocument, pointer: string): readonly unknown[] {
  const list = valueAt(plan, pointer);
  return Array.isArray(list) ? list : [];
}

function pointOf(value: unknown): Point | null {
  if (!isRecord(value)) return null;
  const { latitude_deg: lat, longitude_deg: lon } = value;
  return typeof lat === "number" && typeof lon === "number" && Math.abs(lat) <= 90 && Math.abs(lon) <= 180
    ? [lon, lat]
    : null;
}
