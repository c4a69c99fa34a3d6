/**
 * The coastlines and borders of the world under the grid, which ship with the page: Natural Earth 1:110m, public
 * domain (naturalearthdata.com), as GeoJSON. Its lines are kilometres off, so it fades before anybody could take it
 * for a map to fly by.
 */

import type { ExpressionSpecification, LayerSpecification, SourceSpecification } from "maplibre-gl";
import type { MapLook } from "./look";
import worldUrl from "./world-110m.json?url";

const FADES: readonly [from: number, gone: number] = [7, 9];
const OPACITY: ExpressionSpecification = ["interpolate", ["linear"], ["zoom"], FADES[0], 1, FADES[1], 0];

/** An operator's own map takes its place. */
export function worldSources({ tiles }: MapLook): Record<string, SourceSpecification> {
  if (tiles !== null) return {};
  return { world: { type: "geojson", data: new URL(worldUrl, location.href).href, maxzoom: FADES[1] } };
}

export function worldLayers({ palette: p, scale, tiles }: MapLook): LayerSpecification[] {
  if (tiles !== null) return [];
  const kind: ExpressionSpecification = ["get", "kind"];
  return [
    {
      id: "coast",
      type: "line",
      source: "world",
      maxzoom: FADES[1],
      paint: {
        "line-color": p.coast,
        "line-width": ["match", kind, "coast", 1.5 * scale, 0.7 * scale],
        "line-opacity": OPACITY,
      },
    },
  ];
}
