/**
 * The coarse world under the grid, which ships with the page: Natural Earth 1:50m, public domain, as
 * tools/coarse-world.ts makes it. Its lines are kilometres off: before anybody could take it for a map to fly by,
 * coasts and borders fade and all is land.
 */

import type { ExpressionSpecification, LayerSpecification, SourceSpecification } from "maplibre-gl";
import { labelLayout, labelPaint, type MapLook } from "./look";
import worldUrl from "./world.json?url";

const FADES: readonly [from: number, gone: number] = [6, 8];
const NAMED: readonly [from: number, to: number] = [2.2, 7];
const OPACITY: ExpressionSpecification = ["interpolate", ["linear"], ["zoom"], FADES[0], 1, FADES[1], 0];

/** Its areas have the names of the countries; it is there to be asked at every zoom, and drawn until it has faded. */
export const LAND_LAYER = "land";

export function worldSources(): Record<string, SourceSpecification> {
  return { world: { type: "geojson", data: new URL(worldUrl, location.href).href, maxzoom: FADES[1] } };
}

/** Water where no land is, until nobody can tell any more. */
export function worldBackground({ palette: p }: MapLook): LayerSpecification {
  return {
    id: "background",
    type: "background",
    paint: { "background-color": ["interpolate", ["linear"], ["zoom"], FADES[0], p.water, FADES[1], p.land] },
  };
}

export function worldLayers(look: MapLook): LayerSpecification[] {
  const { palette: p, scale } = look;
  const only = (kind: string): ExpressionSpecification => ["==", ["get", "kind"], kind];
  return [
    {
      id: LAND_LAYER,
      type: "fill",
      source: "world",
      filter: only("land"),
      paint: {
        "fill-color": p.land,
        "fill-opacity": ["step", ["zoom"], 1, FADES[1], 0],
        "fill-antialias": false, // no seams where countries meet
      },
    },
    {
      id: "coast",
      type: "line",
      source: "world",
      maxzoom: FADES[1],
      filter: only("land"),
      paint: { "line-color": p.coast, "line-width": 0.8 * scale, "line-opacity": OPACITY },
    },
    {
      id: "countryName",
      type: "symbol",
      source: "world",
      minzoom: NAMED[0],
      maxzoom: NAMED[1],
      filter: only("name"),
      layout: { ...labelLayout("name", 11 * scale), "text-max-width": 6 },
      paint: { ...labelPaint(p.ringText, p), "text-halo-color": p.land, "text-halo-width": 1 },
    },
  ];
}
