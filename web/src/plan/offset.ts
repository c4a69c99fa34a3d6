/** Where a parcel left beside where it should: east and north of the planned point, and how large to draw it. Pure. */

import type { DropRecord } from "../api/types";
import { roundDistance } from "../format/units";

const METRES_PER_DEGREE = 111_195;

export interface Offset {
  readonly east_m: number;
  readonly north_m: number;
}

/** Null if either place is not known. */
export function offsetOf(drop: DropRecord): Offset | null {
  const { planned_latitude_deg: lat0, planned_longitude_deg: lon0, latitude_deg: lat, longitude_deg: lon } = drop;
  if (lat0 === null || lon0 === null || lat === null || lon === null) return null;
  return { east_m: (lon - lon0) * METRES_PER_DEGREE * Math.cos((lat0 * Math.PI) / 180), north_m: (lat - lat0) * METRES_PER_DEGREE };
}

/** The radius of the picture's ring: round, around the release, and around what was allowed. */
export function pictureRadius({ east_m, north_m }: Offset, allowed_m: number | null): number {
  return roundDistance(Math.max(1, Math.hypot(east_m, north_m), allowed_m ?? 0) * 1.02);
}
