/**
 * What the operator looks at. It lives in the address (#vehicle=v1&run=r7&panel=run), so a reload or a link keeps it.
 */

import { batch, computed, signal } from "@preact/signals";
import type { Run } from "../api/types";
import { hasRunEnded, newestRuns, shownRun } from "./runs";
import { runs, vehicles } from "./store";

export const PANELS = ["plan", "run", "jobs", "offboard", "simulator"] as const;
export type Panel = (typeof PANELS)[number];

/** On a narrow page one view is shown at a time. */
export const VIEWS = ["map", "fleet", "plan", "run", "jobs", "offboard", "simulator", "feed"] as const;
export type View = (typeof VIEWS)[number];

const start = new URLSearchParams(location.hash.slice(1));

export const vehicleId = signal<string | null>(start.get("vehicle"));
export const runId = signal<string | null>(start.get("run"));
export const panel = signal<Panel>(PANELS.find((name) => name === start.get("panel")) ?? "run");
export const view = signal<View>(VIEWS.find((name) => name === start.get("view")) ?? "map");
/** Item that list and map point at together. */
export const itemId = signal<string | null>(null);

export const selectedVehicle = computed(() =>
  vehicleId.value === null ? null : (vehicles.value[vehicleId.value] ?? null),
);

/** The vehicle that is shown while none is chosen. */
let shownVehicle: string | null = null;

/**
 * The chosen run; if none is chosen, the open run of the chosen vehicle, else its newest one. A choice that is not
 * known has none: commands on another run would be given to another vehicle. For the same reason the vehicle stays
 * while none is chosen: first that of the newest open run, else of the newest one.
 */
export const selectedRun = computed(() => {
  if (runId.value !== null) return runs.value[runId.value] ?? null;
  if (vehicleId.value !== null) return runOf(vehicleId.value);
  if (shownVehicle !== null) return runOf(shownVehicle);
  const newest = newestRuns(runs.value);
  const run = newest.find((one) => !hasRunEnded(one)) ?? newest[0] ?? null;
  shownVehicle = run?.vehicle_id ?? null;
  return run;
});

function runOf(vehicle: string): Run | null {
  return shownRun(vehicles.value[vehicle] ?? { id: vehicle, run_id: null }, runs.value);
}

export function selectVehicle(id: string): void {
  vehicleId.value = id;
  runId.value = null;
  itemId.value = null;
}

export function selectRun(id: string): void {
  // at once: whoever reads an unknown run moves the selection only if it still is what it was
  batch(() => {
    runId.value = id;
    vehicleId.value = runs.value[id]?.vehicle_id ?? vehicleId.value;
    itemId.value = null;
    showPanel("run");
  });
}

/** The open run of the chosen vehicle is shown then, else its newest one; without one, those of all vehicles count. */
export function chooseNoRun(): void {
  shownVehicle = null;
  runId.value = null;
  itemId.value = null;
}

/**
 * To be asked after an answer: whether the user still looks at what they looked at when this was called. One who has
 * turned to something else, as to manual control, is not taken away from it.
 */
export function attention(): () => boolean {
  const looksAt = () => [vehicleId.peek(), runId.peek(), panel.peek(), view.peek()].join("\n");
  const before = looksAt();
  return () => looksAt() === before;
}

export function showPanel(next: Panel): void {
  panel.value = next;
  if (view.value !== "map") view.value = next;
}

/** On a narrow page: go to a view, and let the wide page's panel follow. */
export function showView(next: View): void {
  view.value = next;
  panel.value = PANELS.find((name) => name === next) ?? panel.value;
}
