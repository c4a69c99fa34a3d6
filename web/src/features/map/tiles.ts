/**
 * The map of an operator's choice under our own grid, as the page's document names it; none unless it is configured.
 */

import type { LayerSpecification, SourceSpecification } from "maplibre-gl";
import type { Theme } from "../../store/preferences";

export interface TileSource {
  readonly url: string;
  readonly by: string;
  readonly zooms: readonly [low: number, high: number];
}

const ALL_ZOOMS = [0, 19] as const;

/** `meta` reads a <meta> of the document, `origin` is the page's own. */
export function readTiles(meta: (name: string) => string | null, origin: string): TileSource | null {
  const url = meta("waydrop-tiles");
  if (url === null || url === "") return null;
  const [low = NaN, high = NaN] = (meta("waydrop-tiles-zooms") ?? "")
    .split(" ")
    .map((word) => Number.parseInt(word, 10));
  const zooms = Number.isFinite(low) && Number.isFinite(high) ? ([low, high] as const) : ALL_ZOOMS;
  return { url: url.startsWith("/") ? origin + url : url, by: meta("waydrop-tiles-by") ?? "", zooms };
}

export function tileSources(tiles: TileSource | null): Record<string, SourceSpecification> {
  if (tiles === null) return {};
  const [minzoom, maxzoom] = tiles.zooms;
  return { tiles: { type: "raster", tiles: [tiles.url], tileSize: 256, minzoom, maxzoom } };
}

/** In the dark most maps are too bright for what lies on them. */
export function tileLayers(tiles: TileSource | null, theme: Theme): LayerSpecification[] {
  if (tiles === null) return [];
  const paint =
    theme === "dark" ? { "raster-brightness-max": 0.34, "raster-saturation": -0.3 } : { "raster-opacity": 0.85 };
  return [{ id: "tiles", type: "raster", source: "tiles", paint: { ...paint, "raster-fade-duration": 0 } }];
}
