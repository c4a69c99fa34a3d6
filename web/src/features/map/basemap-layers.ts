/** The chosen map as parts of our own style: sources and layers below ours, with texts in the page's own typeface. */

import type { LayerSpecification, SourceSpecification, StyleSpecification } from "maplibre-gl";
import type { Theme } from "../../store/preferences";
import type { BasemapName, MapSettings, TileSource } from "./basemaps";
import { FONT } from "./look";

export interface BasemapLayers {
  readonly sources: Readonly<Record<string, SourceSpecification>>;
  readonly layers: readonly LayerSpecification[];
  readonly sprite?: StyleSpecification["sprite"];
  /** It covers the whole world, so that the coarse one need not be drawn. */
  readonly whole: boolean;
}

export const WORLD_ONLY: BasemapLayers = { sources: {}, layers: [], whole: false };
const OSM = '<a href="https://www.openstreetmap.org/copyright">© OpenStreetMap</a>';
/** Ids of other styles do not meet ours. */
const PREFIX = "base:";
const PICTURES = `${PREFIX}pictures`;

export async function loadBasemap(name: BasemapName, settings: MapSettings, mode: Theme): Promise<BasemapLayers> {
  switch (name) {
    case "world":
      return WORLD_ONLY;
    case "tiles":
      if (settings.tiles === null) return WORLD_ONLY;
      return settings.tiles.vector === true ? vectorTiles(settings.tiles, mode) : pictures(settings.tiles, mode);
    case "satellite":
      return settings.satellite === null ? WORLD_ONLY : pictures(settings.satellite, mode);
    case "streets": {
      if (settings.styles === null) return WORLD_ONLY;
      const address = settings.styles[mode];
      const answer = await fetch(address, { credentials: "omit" });
      if (!answer.ok) throw new Error(`status ${answer.status}`);
      return layersOfStyle((await answer.json()) as StyleSpecification, address);
    }
  }
}

/** In the dark most maps are too bright for what lies on them. */
function pictures(tiles: TileSource, mode: Theme): BasemapLayers {
  const paint =
    mode === "dark" ? { "raster-brightness-max": 0.34, "raster-saturation": -0.3 } : { "raster-opacity": 0.85 };
  return {
    sources: { [PICTURES]: { type: "raster", tileSize: 256, ...sourceOf(tiles) } },
    layers: [{ id: PICTURES, type: "raster", source: PICTURES, paint: { ...paint, "raster-fade-duration": 0 } }],
    whole: false,
  };
}

/** Protomaps' style, loaded only for such tiles. Around the area of a file the coarse world stays in sight. */
async function vectorTiles(tiles: TileSource, mode: Theme): Promise<BasemapLayers> {
  const { layers, namedFlavor } = await import("@protomaps/basemaps");
  const drawn = layers("tiles", namedFlavor(mode), { lang: "en" }).filter(({ type }) => type !== "background");
  const source = sourceOf({ ...tiles, attribution: tiles.attribution || OSM });
  return {
    ...layersOfStyle({ version: 8, sources: { tiles: { type: "vector", ...source } }, layers: drawn }),
    whole: false,
  };
}

function sourceOf({ url, attribution, zooms: [minzoom, maxzoom] = [0, 19] }: TileSource) {
  return { tiles: [url.startsWith("/") ? location.origin + url : url], minzoom, maxzoom, attribution };
}

/**
 * A whole style as layers of ours. Its glyph server is not asked: MapLibre draws the texts with the page's typeface.
 * Addresses may be relative to `address`, where it comes from.
 */
export function layersOfStyle(style: StyleSpecification, address: string = location.href): BasemapLayers {
  const absolute = (url: string) => decodeURI(new URL(url, address).href);
  const sources = Object.entries(style.sources).map(([id, source]) => {
    const url = "url" in source && typeof source.url === "string" ? { url: absolute(source.url) } : {};
    const tiles = "tiles" in source && source.tiles !== undefined ? { tiles: source.tiles.map(absolute) } : {};
    return [PREFIX + id, { ...source, ...url, ...tiles } as SourceSpecification] as const;
  });
  const layers = style.layers.map((layer) => {
    const source = "source" in layer && typeof layer.source === "string" ? { source: PREFIX + layer.source } : {};
    return { ...(inOwnFont(layer) as LayerSpecification), ...source, id: PREFIX + layer.id } as LayerSpecification;
  });
  return { sources: Object.fromEntries(sources), layers, ...spriteOf(style, absolute), whole: true };
}

function spriteOf({ sprite }: StyleSpecification, absolute: (url: string) => string): Pick<BasemapLayers, "sprite"> {
  if (sprite === undefined) return {};
  if (typeof sprite === "string") return { sprite: absolute(sprite) };
  return { sprite: sprite.map(({ id, url }) => ({ id, url: absolute(url) })) };
}

/** Wherever a layer names a font: in its layout, and in the parts of formatted texts. */
function inOwnFont(value: unknown, key = ""): unknown {
  if (key === "text-font") return ["literal", FONT];
  if (typeof value === "string") return value.replace(/^pgf:/, ""); // not Protomaps' texts for a font of its own
  if (Array.isArray(value)) return value.map((part) => inOwnFont(part));
  if (typeof value !== "object" || value === null) return value;
  return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, inOwnFont(part, name)]));
}

export function isOfBasemap(sourceId: unknown): boolean {
  return typeof sourceId === "string" && sourceId.startsWith(PREFIX);
}
