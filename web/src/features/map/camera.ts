/**
 * Where the map looks by itself: the fleet or plan when there is something new to see, and a vehicle being followed.
 */

import type { Vehicle } from "../../api/types";
import { boundsOf, circleRing, type Point } from "../../geo/geometry";
import type { PlanView } from "../plan/document";

export function homeOf(vehicle: Vehicle | null, plan: PlanView | null): Point | null {
  const home = vehicle?.state.home;
  return home ? [home.longitude_deg, home.latitude_deg] : (plan?.home ?? null);
}

/** All that a plan spans. */
export function planPoints(plan: PlanView): Point[] {
  const fences = plan.fences.flatMap(({ shape }) =>
    "ring" in shape ? shape.ring : circleRing(shape.centre, shape.radius_m, 8),
  );
  return [
    ...plan.items.map((item) => item.at).filter((at) => at !== null),
    ...fences,
    ...(plan.home ? [plan.home] : []),
  ];
}

/** Bounds with room around a single point, so that one parked vehicle is not shown at the deepest zoom. */
export function boundsAround(points: readonly Point[]): [number, number, number, number] | null {
  return boundsOf(points.flatMap((point) => circleRing(point, 25, 4)));
}
