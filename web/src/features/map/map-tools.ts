/** The map's own tools: measuring, places that were found, and zones of files, which the browser keeps. */

import { signal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import type { Point } from "../../geo/geometry";
import { mapCentre } from "../../store/map-view";
import { manualControl } from "../offboard/control-state";
import { chooseTool } from "../plan/map-editor";
import { findPlace } from "./find-place";
import { readZones, type Zones } from "./zones";

export const measuring = signal(false);
/** None, one, or both ends. */
export const measured = signal<readonly Point[]>([]);

export function measure(on: boolean): void {
  if (on) chooseTool(null);
  measuring.value = on;
  measured.value = [];
}

/** True if the click was for measuring; the third one begins anew. */
export function measurePoint(at: Point): boolean {
  if (!measuring.value) return false;
  measured.value = measured.value.length === 1 ? [...measured.value, at] : [at];
  return true;
}

export const finderOpen = signal(false);
export const found = signal<Point | null>(null);

/** False if the text is no place. */
export function find(text: string): boolean {
  found.value = findPlace(text, mapCentre.value);
  return found.value !== null;
}

export function openFinder(open: boolean): void {
  finderOpen.value = open;
  if (!open) found.value = null;
}

const KEY = "waydrop.zones";
export const zones = signal<readonly Zones[]>(keptZones());
export const zonesOpen = signal(false);
export const zonesProblem = signal<string | null>(null);
/** The one that was opened last: it is brought into view. */
export const newZones = signal<Zones | null>(null);

function keptZones(): Zones[] {
  try {
    const kept = JSON.parse(localStorage.getItem(KEY) ?? "[]") as readonly Zones[];
    return kept.map(({ name, data }) => readZones(name, JSON.stringify(data)));
  } catch {
    return []; // of another version, or written by somebody else
  }
}

function keep(next: readonly Zones[]): void {
  zones.value = next;
  try {
    localStorage.setItem(KEY, JSON.stringify(next));
  } catch {
    zonesProblem.value = "The browser has no room to keep them: they are gone after a reload.";
  }
}

/** One file of a name: opened again it is replaced. */
export async function openZones(file: File): Promise<void> {
  const name = file.name.replace(/\.(geo)?json$/i, "");
  zonesOpen.value = true;
  zonesProblem.value = null;
  try {
    const read = readZones(name, await file.text());
    keep([...zones.value.filter((other) => other.name !== name), read]);
    newZones.value = read;
  } catch (error) {
    zonesProblem.value = `${file.name}: ${error instanceof Error ? error.message : String(error)}`;
  }
}

export function removeZones(name: string): void {
  keep(zones.value.filter((one) => one.name !== name));
}

function isForTools({ target, ctrlKey, altKey, metaKey }: KeyboardEvent): boolean {
  const typing = target instanceof Element && target.closest("input, textarea, select, dialog") !== null;
  return !typing && !ctrlKey && !altKey && !metaKey && manualControl.peek().phase === "off";
}

/** True if the key was for a tool. */
function onKey(key: string): boolean {
  if (key === "m" || key === "M") measure(!measuring.peek());
  else if (key === "/") openFinder(true);
  else if (key === "Escape" && measuring.peek()) measure(false);
  else return false;
  return true;
}

/** M measures, / finds a place, Escape puts them away; not while somebody types or has manual control. */
export function useMapToolKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (isForTools(event) && onKey(event.key)) event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
