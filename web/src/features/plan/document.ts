/**
 * A plan document as far as it can be drawn and listed. Tolerant: it reads half-written plans while somebody types;
 * what is wrong with them is the service's to say. Pure.
 */

import type { PlanDocument } from "../../api/types";
import type { Point } from "../../geo/geometry";
import { itemType } from "./item-types";

export interface PlanItemView {
  readonly id: string;
  readonly index: number;
  readonly type: string;
  readonly at: Point | null;
  readonly fields: Readonly<Record<string, unknown>>;
}

interface FenceView {
  readonly kind: "inclusion" | "exclusion";
  readonly shape: { readonly ring: readonly Point[] } | { readonly centre: Point; readonly radius_m: number };
}

export interface PlanView {
  readonly name: string;
  readonly vehicleType: string | null;
  readonly items: readonly PlanItemView[];
  readonly fences: readonly FenceView[];
  readonly rallyPoints: readonly Point[];
  readonly home: Point | null;
}

type ParsedPlan = { readonly plan: PlanDocument } | { readonly error: string } | null;

/** The plan in a text; null for an empty text, a sentence if it is no JSON object. */
export function parsePlanText(text: string): ParsedPlan {
  if (text.trim() === "") return null;
  try {
    const doc: unknown = JSON.parse(text);
    return isRecord(doc) ? { plan: doc } : { error: "A plan is a JSON object: { … }." };
  } catch (error) {
    return { error: `This is not JSON: ${error instanceof Error ? error.message : String(error)}` };
  }
}

const views = new WeakMap<PlanDocument, PlanView>();

/** Worked out once for each document, which never changes: a run's panel asks for it with each drop and event. */
export function viewPlan(plan: PlanDocument): PlanView {
  const view = views.get(plan) ?? readPlan(plan);
  views.set(plan, view);
  return view;
}

function readPlan(plan: PlanDocument): PlanView {
  const fence = isRecord(plan["geofence"]) ? plan["geofence"] : {};
  return {
    name: textOf(plan["name"]) ?? "Unnamed plan",
    vehicleType: textOf(plan["vehicle_type"]),
    items: records(plan["items"]).map(viewItem),
    fences: [...records(fence["polygons"]).flatMap(viewPolygon), ...records(fence["circles"]).flatMap(viewCircle)],
    rallyPoints: points(plan["rally_points"]),
    home: isRecord(plan["home"]) ? pointOf(plan["home"]) : null,
  };
}

/** A stored plan names every field; one that is null is not given, and not worth a line. */
export function omitNulls(plan: PlanDocument): PlanDocument {
  const tidy = JSON.parse(JSON.stringify(plan), (_, value: unknown) => (value === null ? undefined : value)) as unknown;
  return isRecord(tidy) ? tidy : plan;
}

/** The item that a finding is about: by its id, else by its pointer (/items/3/...). */
export function findingItem(
  finding: { item_id: string | null; pointer: string },
  items: readonly PlanItemView[],
): PlanItemView | null {
  const named = items.find((item) => item.id === finding.item_id);
  if (named) return named;
  const index = /^\/items\/(\d+)/.exec(finding.pointer)?.[1];
  return index === undefined ? null : (items[Number(index)] ?? null);
}

interface AlternateView {
  readonly id: string;
  readonly at: Point | null;
}

/** Where the parcel of a drop goes if the drop fails; null if nowhere. */
export function alternateOf(item: PlanItemView): AlternateView | null {
  const other = item.type === "gripper" ? item.fields["alternate"] : null;
  return isRecord(other) ? { id: textOf(other["id"]) ?? `${item.id}-alternate`, at: pointOf(other) } : null;
}

/** Where each drop item happens: at the last position before it. */
export function dropPoints(items: readonly PlanItemView[]): Map<string, Point> {
  const places = new Map<string, Point>();
  let last: Point | null = null;
  for (const item of items) {
    last = item.at ?? last;
    if (isDrop(item) && last !== null) places.set(item.id, last);
  }
  return places;
}

export function isDrop(item: { readonly type: string }): boolean {
  return itemType(item.type).is_drop;
}

function viewItem(fields: Record<string, unknown>, index: number): PlanItemView {
  return {
    id: textOf(fields["id"]) ?? `item-${index + 1}`, // the name that the service gives to an item without one
    index,
    type: textOf(fields["type"]) ?? "unknown",
    at: pointOf(fields),
    fields,
  };
}

function viewPolygon(doc: Record<string, unknown>): FenceView[] {
  const ring = points(doc["vertices"]);
  const first = ring[0];
  return first && ring.length > 2 ? [{ kind: kindOf(doc), shape: { ring: [...ring, first] } }] : [];
}

function viewCircle(doc: Record<string, unknown>): FenceView[] {
  const centre = pointOf(doc);
  const radius_m = doc["radius_m"];
  return centre !== null && typeof radius_m === "number" ? [{ kind: kindOf(doc), shape: { centre, radius_m } }] : [];
}

function kindOf(doc: Record<string, unknown>): "inclusion" | "exclusion" {
  return doc["kind"] === "exclusion" ? "exclusion" : "inclusion";
}

function pointOf(doc: Record<string, unknown>): Point | null {
  const { latitude_deg: lat, longitude_deg: lon } = doc;
  if (typeof lat !== "number" || typeof lon !== "number") return null;
  return Math.abs(lat) <= 90 && Math.abs(lon) <= 180 ? [lon, lat] : null;
}

function points(value: unknown): Point[] {
  return records(value)
    .map(pointOf)
    .filter((point) => point !== null);
}

function records(value: unknown): Record<string, unknown>[] {
  return Array.isArray(value) ? value.map((entry) => (isRecord(entry) ? entry : {})) : [];
}

function textOf(value: unknown): string | null {
  return typeof value === "string" && value !== "" ? value : null;
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
