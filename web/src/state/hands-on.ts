/** Who is flown by hand from this page, and how far that is. */

import { computed, signal } from "@preact/signals";
import type { Offboard, Run, Vehicle } from "../api/types";
import { HANDS_OFF, type HandsOn } from "../hands-on/session";
import { currentRun } from "./runs";
import { selectedVehicle } from "./selection";
import { live, runs, vehicles } from "./store";

export const handsOn = signal<HandsOn>(HANDS_OFF);
/** The controls count. */
export const engaged = computed(() => handsOn.value.phase === "entering" || handsOn.value.phase === "flying");

/** Hands lead: the page says all the time what they want. */
export const steering = computed(() => engaged.value && handsOn.value.leads === "hands");

/** What is chosen to fly with. */
export const handsPage = signal<"controls" | "tasks">("controls");

/** The controls are shown, and their keys count. */
export const byControls = computed(() => engaged.value && handsPage.value === "controls" && !handsOn.value.tasksOnly);

/** The vehicle that the panel is about: the one that is flown, else the chosen one. */
export const handsVehicle = computed<Vehicle | null>(() => {
  const flown = handsOn.value.vehicle;
  return handsOn.value.phase === "off" || flown === null ? selectedVehicle.value : (vehicles.value[flown] ?? null);
});

/** The open run of that vehicle. */
export const handsRun = computed<Run | null>(() => (handsVehicle.value === null ? null : currentRun(handsVehicle.value, runs.value)));

/** From the own socket while there is one, else from the stream, as everybody sees it; null without either. */
export const offboardNow = computed<Offboard | null>(() => handsOn.value.offboard ?? (live.value ? (handsVehicle.value?.state.offboard ?? null) : null));
