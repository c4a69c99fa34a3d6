/**
 * Small-distance geometry on the sphere, for drawing. Points are [longitude_deg, latitude_deg], as GeoJSON has them.
 */

import type { Vehicle } from "../api/types";

export type Point = [longitude_deg: number, latitude_deg: number];

const EARTH_RADIUS_M = 6_371_008.8;
const RAD = Math.PI / 180;

/** Great-circle distance. */
export function metresBetween([lon1, lat1]: Point, [lon2, lat2]: Point): number {
  const dLat = (lat2 - lat1) * RAD;
  const dLon = (lon2 - lon1) * RAD;
  const h = Math.sin(dLat / 2) ** 2 + Math.cos(lat1 * RAD) * Math.cos(lat2 * RAD) * Math.sin(dLon / 2) ** 2;
  return 2 * EARTH_RADIUS_M * Math.asin(Math.min(1, Math.sqrt(h)));
}

/** A closed ring around `centre`; flat-earth, good to well under a pixel for fences and range rings. */
export function circleRing(centre: Point, radius_m: number, sides = 72): Point[] {
  const ring: Point[] = [];
  for (let i = 0; i <= sides; i++) ring.push(offset(centre, radius_m, (i * 360) / sides));
  return ring;
}

/** The point `distance_m` from `from` towards `bearing_deg`. */
export function offset([lon, lat]: Point, distance_m: number, bearing_deg: number): Point {
  const north = (distance_m * Math.cos(bearing_deg * RAD)) / EARTH_RADIUS_M / RAD;
  const east = (distance_m * Math.sin(bearing_deg * RAD)) / EARTH_RADIUS_M / RAD / Math.cos(lat * RAD);
  return [lon + east, lat + north];
}

/** West, south, east, north of all points; null if there are none. */
export function boundsOf(points: readonly Point[]): [number, number, number, number] | null {
  if (points.length === 0) return null;
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [lon, lat] of points) {
    west = Math.min(west, lon);
    east = Math.max(east, lon);
    south = Math.min(south, lat);
    north = Math.max(north, lat);
  }
  return [west, south, east, north];
}

export function vehiclePoint(vehicle: Vehicle | null): Point | null {
  const lat = vehicle?.state.latitude_deg ?? null;
  const lon = vehicle?.state.longitude_deg ?? null;
  return lat === null || lon === null ? null : [lon, lat];
}
