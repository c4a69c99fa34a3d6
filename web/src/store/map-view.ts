/** What the map shows now, and whether it follows the chosen vehicle. */

import { computed, signal } from "@preact/signals";
import { metresBetween, type Point } from "../geo/geometry";

export interface MapExtent {
  readonly west: number;
  readonly south: number;
  readonly east: number;
  readonly north: number;
  readonly width_px: number;
  readonly height_px: number;
}

/** Keep the selected vehicle in the centre, until the user moves the map. */
export const following = signal(false);

/** The country in the middle of the map, by the coarse world; null at sea and where it is not known. */
export const country = signal<string | null>(null);

/** What the map shows now. */
export const mapExtent = signal<MapExtent | null>(null);
export const mapCentre = computed<Point>(() => {
  const view = mapExtent.value;
  return view === null ? [0, 0] : [(view.west + view.east) / 2, (view.south + view.north) / 2];
});
export const mapHeight_m = computed(() => {
  const view = mapExtent.value;
  return view === null ? 0 : metresBetween([view.west, view.south], [view.west, view.north]);
});
