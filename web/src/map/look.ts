/** What all layers of the map have in common: colours and scale, lines and text. */

import type { ExpressionSpecification, LineLayerSpecification } from "maplibre-gl";
import type { Theme } from "../state/theme";
import type { Palette } from "./palette";
import type { Tiles } from "./tiles";

/** Without a glyph server MapLibre draws text with the page's own fonts. */
export const FONT = ["Inter", "system-ui", "sans-serif"];
export const ROUND: LineLayerSpecification["layout"] = { "line-cap": "round", "line-join": "round" };

/** How the map looks: its colours, and how large it draws (1 with the text of a laptop, more on a wall). */
export interface Look {
  readonly palette: Palette;
  readonly theme: Theme;
  /** The map under ours; null without one. */
  readonly tiles: Tiles | null;
  readonly scale: number;
}

export function text(field: string, size: number) {
  const value: ExpressionSpecification = ["get", field];
  return { "text-field": value, "text-font": FONT, "text-size": size };
}

export function textPaint(color: string, p: Palette) {
  return { "text-color": color, "text-halo-color": p.halo, "text-halo-width": 1.6 };
}
