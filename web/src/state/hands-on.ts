/** Which vehicle this page controls, and how far that is. */

import { computed, signal } from "@preact/signals";
import type { Offboard, Run, Vehicle } from "../api/types";
import { CONTROL_OFF, type ManualControl } from "../hands-on/session";
import { currentRun } from "./runs";
import { selectedVehicle } from "./selection";
import { live, runs, vehicles } from "./store";

export const manualControl = signal<ManualControl>(CONTROL_OFF);
/** The controls count. */
export const engaged = computed(() => manualControl.value.phase === "entering" || manualControl.value.phase === "flying");

/** The controls lead: the page says all the time what they want. */
export const steering = computed(() => engaged.value && manualControl.value.leads === "controls");

/** What is chosen to fly with. */
export const controlPage = signal<"controls" | "tasks">("controls");

/** The controls are shown, and their keys count. */
export const byControls = computed(() => engaged.value && controlPage.value === "controls" && !manualControl.value.tasksOnly);

/** The vehicle that the panel is about: the one that is flown, else the chosen one. */
export const controlledVehicle = computed<Vehicle | null>(() => {
  const flown = manualControl.value.vehicle;
  return manualControl.value.phase === "off" || flown === null ? selectedVehicle.value : (vehicles.value[flown] ?? null);
});

/** The open run of that vehicle. */
export const controlledRun = computed<Run | null>(() => (controlledVehicle.value === null ? null : currentRun(controlledVehicle.value, runs.value)));

/** From the own socket while there is one, else from the stream, as everybody sees it; null without either. */
export const offboardNow = computed<Offboard | null>(() => manualControl.value.offboard ?? (live.value ? (controlledVehicle.value?.state.offboard ?? null) : null));
