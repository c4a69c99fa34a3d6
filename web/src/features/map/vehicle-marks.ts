/** The vehicles as the map shows them, and which vehicle a pointer means. Pure. */

import type { Vehicle } from "../../api/types";
import { joinParts } from "../../format/text";
import { formatWholeAltitude } from "../../format/units";
import type { Point } from "../../geo/geometry";
import { STALE_LINK_S } from "../fleet/filter";

export interface VehicleMark {
  readonly id: string;
  readonly at: Point;
  /** A name for `drawIcon`. */
  readonly icon: string;
  readonly heading_deg: number;
  readonly selected: boolean;
  readonly label: string;
  /** What is shown is from before its link was lost, or the page's connection. */
  readonly stale: boolean;
}

/** On the screen, in its pixels. */
export interface ScreenPoint {
  readonly x: number;
  readonly y: number;
}

/** Those whose position is known; the selected one last, which is on top. */
export function vehicleMarks(
  vehicles: Readonly<Record<string, Vehicle>>,
  selected: string | null,
  live: boolean,
): VehicleMark[] {
  const marks = Object.values(vehicles).flatMap((vehicle): VehicleMark[] => {
    const { latitude_deg: lat, longitude_deg: lon, heading_deg, relative_altitude_m: altitude } = vehicle.state;
    if (lat === null || lon === null) return [];
    const parts = [
      vehicle.id,
      altitude === null || altitude < 1 ? "" : formatWholeAltitude(altitude),
      vehicle.state.connected ? "" : "lost",
    ];
    return [
      {
        id: vehicle.id,
        at: [lon, lat],
        icon: `vehicle:${vehicle.vehicle_type ?? "unknown"}:${toneOf(vehicle, live)}`,
        heading_deg: Math.round(heading_deg ?? 0),
        selected: vehicle.id === selected,
        label: joinParts(parts),
        stale: isStale(vehicle, live),
      },
    ];
  });
  return marks.sort((a, b) => Number(a.selected) - Number(b.selected));
}

function toneOf({ state, quarantined }: Vehicle, live: boolean): string {
  if (quarantined !== null || state.in_failsafe) return "danger";
  return isStale({ state }, live) ? "stale" : "ok";
}

function isStale({ state }: Pick<Vehicle, "state">, live: boolean): boolean {
  return !live || !state.connected || (state.heartbeat_age_s ?? 0) >= STALE_LINK_S;
}

export function sameMarks(before: readonly VehicleMark[], after: readonly VehicleMark[]): boolean {
  return (
    before.length === after.length &&
    after.every((mark, i) => {
      const was = before[i];
      return (
        was !== undefined &&
        was.id === mark.id &&
        was.at[0] === mark.at[0] &&
        was.at[1] === mark.at[1] &&
        was.icon === mark.icon &&
        was.heading_deg === mark.heading_deg &&
        was.selected === mark.selected &&
        was.label === mark.label &&
        was.stale === mark.stale
      );
    })
  );
}

/** A longitude as far round the world as what is looked at: beyond the date line too. */
export function unwrapLongitude(longitude_deg: number, middle_deg: number): number {
  return longitude_deg + 360 * Math.round((middle_deg - longitude_deg) / 360);
}

/** The index of the nearest place within reach, the later one of two as near; null without one. */
export function nearestIndex(places: readonly ScreenPoint[], at: ScreenPoint, reach_px: number): number | null {
  let nearest: number | null = null;
  let least = reach_px;
  for (const [i, place] of places.entries()) {
    const away = Math.hypot(place.x - at.x, place.y - at.y);
    if (away > least) continue;
    nearest = i;
    least = away;
  }
  return nearest;
}
