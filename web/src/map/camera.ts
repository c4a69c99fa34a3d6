/** Where the map looks by itself: the fleet or plan when there is something new to see, and a vehicle being followed. */

import { computed, signal } from "@preact/signals";
import type { Vehicle } from "../api/types";
import type { PlanView } from "../plan/document";
import { boundsOf, circleRing, metresBetween, type Point } from "./geometry";
import type { View } from "./graticule";

/** Keep the chosen vehicle in the middle, until somebody moves the map. */
export const following = signal(false);

/** What the map shows now. */
export const viewed = signal<View | null>(null);
export const viewCentre = computed<Point>(() => {
  const view = viewed.value;
  return view === null ? [0, 0] : [(view.west + view.east) / 2, (view.south + view.north) / 2];
});
export const viewHeight_m = computed(() => {
  const view = viewed.value;
  return view === null ? 0 : metresBetween([view.west, view.south], [view.west, view.north]);
});

export function vehiclePoint(vehicle: Vehicle | null): Point | null {
  const lat = vehicle?.state.latitude_deg ?? null;
  const lon = vehicle?.state.longitude_deg ?? null;
  return lat === null || lon === null ? null : [lon, lat];
}

export function homeOf(vehicle: Vehicle | null, plan: PlanView | null): Point | null {
  const home = vehicle?.state.home;
  return home ? [home.longitude_deg, home.latitude_deg] : (plan?.home ?? null);
}

/** All that a plan spans. */
export function planPoints(plan: PlanView): Point[] {
  const fences = plan.fences.flatMap(({ shape }) => ("ring" in shape ? shape.ring : circleRing(shape.centre, shape.radius_m, 8)));
  return [...plan.items.map((item) => item.at).filter((at) => at !== null), ...fences, ...(plan.home ? [plan.home] : [])];
}

/** Bounds with room around a single point, so that one parked vehicle is not shown at the deepest zoom. */
export function boundsAround(points: readonly Point[]): [number, number, number, number] | null {
  return boundsOf(points.flatMap((point) => circleRing(point, 60, 4)));
}
