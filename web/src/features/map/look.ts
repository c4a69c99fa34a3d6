/**
 * Colours of the map, one set per theme. The map draws in WebGL, where the style sheet does not reach. Those that are
 * named as a tone have its colour.
 */

import type { ExpressionSpecification, LineLayerSpecification } from "maplibre-gl";
import type { Theme } from "../../store/preferences";
import type { BasemapLayers } from "./basemap-layers";

export interface Palette {
  background: string;
  land: string;
  water: string;
  coast: string;
  gridMinor: string;
  gridMajor: string;
  ring: string;
  ringText: string;
  info: string;
  pathDone: string;
  pathCasing: string;
  track: string;
  vehicle: string;
  vehicleStale: string;
  danger: string;
  ok: string;
  warn: string;
  drop: string;
  text: string;
  halo: string;
}

export const PALETTES: Readonly<Record<Theme, Palette>> = {
  dark: {
    background: "#0c1219",
    land: "#131b24",
    water: "#0a1929",
    coast: "#3d5166",
    gridMinor: "#1c2733",
    gridMajor: "#2a3948",
    ring: "#3a4c5f",
    ringText: "#8496a8",
    info: "#6cc0ff",
    pathDone: "#3b6f9c",
    pathCasing: "#0c1219",
    track: "#9ff0c8",
    vehicle: "#eaf6ff",
    vehicleStale: "#77879a",
    danger: "#ff8a8a",
    ok: "#4fd8a0",
    warn: "#ffce5c",
    drop: "#ffb86b",
    text: "#e6edf4",
    halo: "#0c1219",
  },
  light: {
    background: "#f2f5f8",
    land: "#f4f5f2",
    water: "#d3e3ef",
    coast: "#a9b6bf",
    gridMinor: "#e6ebf0",
    gridMajor: "#d3dce5",
    ring: "#b3c0cd",
    ringText: "#5a6b7c",
    info: "#0a63a8",
    pathDone: "#8db9da",
    pathCasing: "#ffffff",
    track: "#0a8f5c",
    vehicle: "#10202f",
    vehicleStale: "#8a98a6",
    danger: "#b4232a",
    ok: "#0a6f45",
    warn: "#835000",
    drop: "#96480a",
    text: "#15212c",
    halo: "#ffffff",
  },
};

// What all layers of the map have in common: colours and scale, lines and text.

/** Without a glyph server MapLibre draws text with the page's own fonts. */
export const FONT = ["Inter", "system-ui", "sans-serif"];
export const ROUND: LineLayerSpecification["layout"] = { "line-cap": "round", "line-join": "round" };

/** How the map looks: its colours, and how large it draws (1 with the text of a laptop, more on a wall). */
export interface MapLook {
  readonly palette: Palette;
  readonly theme: Theme;
  /** The chosen map under ours. */
  readonly basemapLayers: BasemapLayers;
  readonly scale: number;
}

export function labelLayout(field: string, size: number) {
  const value: ExpressionSpecification = ["get", field];
  return { "text-field": value, "text-font": FONT, "text-size": size };
}

export function labelPaint(color: string, p: Palette) {
  return { "text-color": color, "text-halo-color": p.halo, "text-halo-width": 1.6 };
}
