/** The maps that can lie under our own grid: for which the service is configured, and which one is shown. Pure. */

import type { Theme } from "../../store/preferences";

export interface TileSource {
  readonly url: string;
  readonly attribution: string;
  readonly zooms?: readonly [low: number, high: number];
  /** Vector tiles in the schema of Protomaps' basemaps, else pictures. */
  readonly vector?: boolean;
}

/** As app/api/tiles.py writes it into the page. */
export interface MapSettings {
  readonly tiles: TileSource | null;
  readonly styles: Readonly<Record<Theme, string>> | null;
  readonly satellite: TileSource | null;
}

/** `world`: the coarse world alone. `tiles`: the operator's own. `streets`: a style over the internet. */
export type BasemapName = "world" | "tiles" | "streets" | "satellite";

const NO_MAPS: MapSettings = { tiles: null, styles: null, satellite: null };

/** `content` is that of the document's <meta name="waydrop-maps">. */
export function readMapSettings(content: string | null): MapSettings {
  return content === null ? NO_MAPS : { ...NO_MAPS, ...(JSON.parse(content) as Partial<MapSettings>) };
}

export function availableBasemaps({ tiles, styles, satellite }: MapSettings): BasemapName[] {
  const names: (BasemapName | null)[] = ["world", tiles && "tiles", styles && "streets", satellite && "satellite"];
  return names.filter((name) => name !== null);
}

/** What is shown: the choice as far as it is still configured, else the operator's own tiles. */
export function basemapFor(settings: MapSettings, choice: BasemapName | null): BasemapName {
  if (choice !== null && availableBasemaps(settings).includes(choice)) return choice;
  return settings.tiles === null ? "world" : "tiles";
}

/** The server that is asked for a map: said before it is. Empty for the service itself. */
export function serverOf(name: BasemapName, settings: MapSettings): string {
  const urls: Readonly<Record<BasemapName, string>> = {
    world: "",
    tiles: settings.tiles?.url ?? "",
    streets: settings.styles?.light ?? "",
    satellite: settings.satellite?.url ?? "",
  };
  return urls[name].startsWith("http") ? new URL(urls[name]).host : "";
}
