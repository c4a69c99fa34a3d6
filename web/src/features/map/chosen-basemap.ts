/**
 * Which map lies under the grid now. Nothing is asked of a server outside before somebody chose its map, or the
 * operator configured its tiles; the choice is kept in the browser.
 */

import { computed, effect, signal } from "@preact/signals";
import { theme } from "../../store/preferences";
import { loadBasemap, WORLD_ONLY } from "./basemap-layers";
import { type BasemapName, basemapFor, readMapSettings, serverOf } from "./basemaps";

/** They never change while the page is open. */
export const mapSettings = readMapSettings(
  document.querySelector<HTMLMetaElement>('meta[name="waydrop-maps"]')?.content ?? null,
);

const KEY = "waydrop.map";
const NAMES: readonly string[] = ["world", "tiles", "streets", "satellite"] satisfies BasemapName[];

function isBasemap(name: string | null): name is BasemapName {
  return name !== null && NAMES.includes(name);
}

function readChoice(): BasemapName | null {
  const kept = localStorage.getItem(KEY);
  return isBasemap(kept) ? kept : null;
}

const chosen = signal<BasemapName | null>(readChoice());

export const basemap = computed(() => basemapFor(mapSettings, chosen.value));

export function chooseBasemap(name: BasemapName): void {
  chosen.value = name;
  localStorage.setItem(KEY, name);
}

/** A map over the internet is offered once, to those who have none. */
export const offersStreets = computed(
  () => chosen.value === null && mapSettings.tiles === null && mapSettings.styles !== null,
);

const loaded = signal(WORLD_ONLY);
/** Why the chosen map is not there, in words. */
export const basemapProblem = signal<string | null>(null);

export const basemapLayers = computed(() => (basemap.value === "world" ? WORLD_ONLY : loaded.value));

function server(): string {
  return serverOf(basemap.peek(), mapSettings) || "this service";
}

/** Some of it does not come; what has come stays. */
export function basemapFailed({ message }: { readonly message: string }): void {
  basemapProblem.value = `The map from ${server()} is not complete (${message}).`;
}

/** Loads what is chosen, and again for another theme. Returns how to end that. */
export function watchBasemap(): () => void {
  return effect(() => {
    const [name, mode] = [basemap.value, theme.value];
    let current = true;
    basemapProblem.value = null;
    loadBasemap(name, mapSettings, mode).then(
      (found) => {
        if (current) loaded.value = found;
      },
      (error: unknown) => {
        if (!current) return;
        loaded.value = WORLD_ONLY;
        const why = error instanceof Error ? error.message : String(error);
        basemapProblem.value = `The map from ${server()} could not be loaded (${why}). The coarse world is shown.`;
      },
    );
    return () => {
      current = false;
    };
  });
}
