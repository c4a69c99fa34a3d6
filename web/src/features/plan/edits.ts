/** What the editor does to a plan document: each edit gives a new document. It never judges; the service does. Pure. */

import type { PlanDocument, VehicleType } from "../../api/types";
import { offset, type Point } from "../../geo/geometry";
import { type PlanItemView, viewPlan } from "./document";
import { ITEM_TYPE_VIEWS, type ItemType, itemType } from "./item-types";
import { isRecord, valueAt, withEntry, withValue } from "./pointer";

export type PlanItem = Readonly<Record<string, unknown>>;
export type FenceKind = "inclusion" | "exclusion";

export const ITEM_TYPES: readonly ItemType[] = ITEM_TYPE_VIEWS.map(({ type }) => type);

interface FlightTraits {
  /** Can stop in the air. */
  readonly stops: boolean;
  /** Takes off to a point ahead instead of straight up. */
  readonly climbsAhead: boolean;
}

const FLIGHT_TRAITS: Readonly<Record<VehicleType, FlightTraits>> = {
  multicopter: { stops: true, climbsAhead: false },
  fixed_wing: { stops: false, climbsAhead: true },
  vtol: { stops: true, climbsAhead: true },
  rover: { stops: true, climbsAhead: false },
  airship: { stops: false, climbsAhead: false },
};

/** A plan may name any text as its vehicle type. */
function flightTraits(plan: PlanDocument): FlightTraits {
  return FLIGHT_TRAITS[plan["vehicle_type"] as VehicleType] ?? FLIGHT_TRAITS.multicopter;
}

const START_ALTITUDE_M = 15;

/** Seven decimals are a centimetre. */
export function pointFields([lon, lat]: Point): { latitude_deg: number; longitude_deg: number } {
  return { latitude_deg: round(lat, 7), longitude_deg: round(lon, 7) };
}

/** An item of a type with what it must have, at a place if it takes one, at the altitude of the item before. */
export function newItem(plan: PlanDocument, type: ItemType, index: number, at: Point): PlanItem {
  const { stem, fresh, has_place, is_drop } = itemType(type);
  const item: PlanItem = {
    id: freshId(plan, stem),
    type,
    ...(has_place ? { ...pointFields(at), ...altitudeBefore(plan, index) } : {}),
    ...fresh,
  };
  if (is_drop) return { ...item, release_motion: motionOf(plan) };
  if (type === "jump") return { ...item, target: targetBefore(plan, index) };
  if (type === "takeoff") return { ...item, ...takeoffPlace(plan, at) };
  return has_place && "relative_altitude_m" in fresh ? onGround(item) : item;
}

function takeoffPlace(plan: PlanDocument, at: Point): PlanItem {
  return flightTraits(plan).climbsAhead
    ? { ...pointFields(offset(at, 150, 0)), relative_altitude_m: 40 }
    : { relative_altitude_m: START_ALTITUDE_M };
}

/** It has an altitude of its own, and not that of the item before. */
function onGround(item: PlanItem): PlanItem {
  const { absolute_altitude_m: _, ...others } = item;
  return others;
}

/** The least plan of a vehicle type that starts and ends where it stands. */
export function newPlan(
  vehicleType: VehicleType,
  home: { readonly latitude_deg: number; readonly longitude_deg: number; readonly absolute_altitude_m: number } | null,
): PlanDocument {
  const empty = {
    version: 1,
    name: "New plan",
    vehicle_type: vehicleType,
    ...(home === null ? {} : { home }),
    items: [],
  };
  const types: ItemType[] =
    vehicleType === "rover"
      ? []
      : vehicleType === "airship"
        ? ["takeoff"]
        : ["takeoff", ...endOf(vehicleType, home !== null)];
  const at: Point = home === null ? [0, 0] : [home.longitude_deg, home.latitude_deg];
  return types.reduce<PlanDocument>((plan, type, i) => withEntry(plan, "/items", i, newItem(plan, type, i, at)), empty);
}

/** A wing lands where the plan says; what hovers finds home by itself. */
function endOf(vehicleType: VehicleType, knowsHome: boolean): ItemType[] {
  if (vehicleType === "multicopter") return ["return_to_launch"];
  return knowsHome ? ["land"] : [];
}

/** Where a new item goes: after the chosen one and the drops that belong to it, else before the end of the flight. */
export function insertionIndex(plan: PlanDocument, chosen: number | null): number {
  const { items } = viewPlan(plan);
  if (chosen !== null && chosen < items.length && !itemType(items[chosen]?.type ?? "").ends)
    return afterDrops(items, chosen);
  const last = items.at(-1);
  return last !== undefined && itemType(last.type).ends ? items.length - 1 : items.length;
}

function afterDrops(items: readonly PlanItemView[], chosen: number): number {
  let next = chosen + 1;
  while (next < items.length && itemType(items[next]?.type ?? "").at_stop) next++;
  return next;
}

export function insertItem(plan: PlanDocument, index: number, item: PlanItem): PlanDocument {
  return withEntry(plan, "/items", index, item);
}

export function removeItem(plan: PlanDocument, index: number): PlanDocument {
  return withValue(plan, `/items/${index}`, undefined);
}

export function moveItem(plan: PlanDocument, from: number, to: number): PlanDocument {
  const items = valueAt(plan, "/items");
  if (!Array.isArray(items) || to < 0 || to >= items.length || from === to) return plan;
  return withValue(plan, "/items", items.toSpliced(from, 1).toSpliced(to, 0, items[from]));
}

/** Another type keeps what both types have (`fields` of the new one) and gets what it must have. */
export function changeType(
  plan: PlanDocument,
  index: number,
  type: ItemType,
  fields: ReadonlySet<string>,
  at: Point,
): PlanDocument {
  const old = valueAt(plan, `/items/${index}`);
  const kept = Object.entries(isRecord(old) ? old : {}).filter(
    ([name, value]) => fields.has(name) && name !== "type" && value !== null,
  );
  return withValue(plan, `/items/${index}`, {
    ...withoutAltitudeOf(kept, newItem(plan, type, index, at)),
    ...Object.fromEntries(kept),
    type,
  });
}

/** Exactly one altitude: a kept one takes the place of the new item's own. */
function withoutAltitudeOf(kept: readonly (readonly [string, unknown])[], item: PlanItem): PlanItem {
  if (!kept.some(([name]) => name === "absolute_altitude_m")) return item;
  const { relative_altitude_m: _, ...others } = item;
  return others;
}

export function addPolygon(plan: PlanDocument, kind: FenceKind, corners: readonly Point[]): PlanDocument {
  return append(plan, "/geofence/polygons", { kind, vertices: corners.map(pointFields) });
}

export function addCircle(plan: PlanDocument, kind: FenceKind, centre: Point, radius_m: number): PlanDocument {
  return append(plan, "/geofence/circles", { kind, ...pointFields(centre), radius_m: round(radius_m, 0) });
}

export function addRallyPoint(plan: PlanDocument, at: Point): PlanDocument {
  return append(plan, "/rally_points", { ...pointFields(at), relative_altitude_m: 20 });
}

function append(plan: PlanDocument, pointer: string, entry: unknown): PlanDocument {
  const list = valueAt(plan, pointer);
  return withEntry(plan, pointer, Array.isArray(list) ? list.length : 0, entry);
}

/** The stem, or the stem with a number, that no item is called yet. */
function freshId(plan: PlanDocument, stem: string): string {
  const taken = new Set(viewPlan(plan).items.map(({ id }) => id));
  if (!taken.has(stem)) return stem;
  let number = 2;
  while (taken.has(`${stem}-${number}`)) number++;
  return `${stem}-${number}`;
}

function altitudeBefore(plan: PlanDocument, index: number): Record<string, number> {
  for (const { fields } of viewPlan(plan).items.slice(0, index).reverse()) {
    for (const name of ["relative_altitude_m", "absolute_altitude_m"]) {
      const value = fields[name];
      if (typeof value === "number") return { [name]: value };
    }
  }
  return { relative_altitude_m: plan["vehicle_type"] === "rover" ? 0 : START_ALTITUDE_M };
}

function motionOf(plan: PlanDocument): "stopped" | "moving" {
  return flightTraits(plan).stops ? "stopped" : "moving";
}

function targetBefore(plan: PlanDocument, index: number): string {
  const before = viewPlan(plan).items.slice(0, index);
  return before.find(({ type }) => type === "waypoint" || type === "loiter")?.id ?? "";
}

export function round(value: number, decimals: number): number {
  return Number(value.toFixed(decimals));
}
