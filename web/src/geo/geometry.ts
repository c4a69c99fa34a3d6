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

/** The direction at `from` of the great circle to `to`, in degrees from north. */
export function bearingBetween([lon1, lat1]: Point, [lon2, lat2]: Point): number {
  const [from, to, turn] = [lat1 * RAD, lat2 * RAD, (lon2 - lon1) * RAD];
  const east = Math.sin(turn) * Math.cos(to);
  const north = Math.cos(from) * Math.sin(to) - Math.sin(from) * Math.cos(to) * Math.cos(turn);
  return (Math.atan2(east, north) / RAD + 360) % 360;
}

/** Points along the great circle; longitudes go on beyond the date line rather than back around the world. */
export function arc(from: Point, to: Point, parts = 64): Point[] {
  const whole = metresBetween(from, to) / EARTH_RADIUS_M;
  if (whole < 1e-6) return [from, to];
  const [[lon1, lat1], [lon2, lat2]] = [from, to].map(([lon, lat]) => [lon * RAD, lat * RAD]) as [Point, Point];
  const points: Point[] = [];
  for (let i = 0; i <= parts; i++) {
    const a = Math.sin((1 - i / parts) * whole) / Math.sin(whole);
    const b = Math.sin((i / parts) * whole) / Math.sin(whole);
    const x = a * Math.cos(lat1) * Math.cos(lon1) + b * Math.cos(lat2) * Math.cos(lon2);
    const y = a * Math.cos(lat1) * Math.sin(lon1) + b * Math.cos(lat2) * Math.sin(lon2);
    const z = a * Math.sin(lat1) + b * Math.sin(lat2);
    const before = points.at(-1)?.[0] ?? lon1 / RAD;
    const lon = Math.atan2(y, x) / RAD;
    points.push([lon + 360 * Math.round((before - lon) / 360), Math.atan2(z, Math.hypot(x, y)) / RAD]);
  }
  return points;
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
