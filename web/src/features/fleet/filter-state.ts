/** What is looked for in the fleet, and who is found. The list follows it; the map goes on showing everybody. */

import { computed, signal } from "@preact/signals";
import { currentRun } from "../../store/runs";
import { runs, vehicleIds, vehicles } from "../../store/store";
import { GROUPS, type Group, isLookedFor } from "./filter";

const start = new URLSearchParams(location.hash.slice(1));

export const fleetQuery = signal(start.get("find") ?? "");
export const fleetGroup = signal<Group>(GROUPS.find((name) => name === start.get("group")) ?? "all");
export const isFiltered = computed(() => fleetQuery.value.trim() !== "" || fleetGroup.value !== "all");

/** As text: telemetry comes many times a second, and who is found changes seldom. */
const found = computed(() => {
  if (!isFiltered.value) return vehicleIds.value.join("\n");
  const known = vehicles.value;
  return vehicleIds.value
    .filter((id) => {
      const vehicle = known[id];
      return (
        vehicle !== undefined &&
        isLookedFor(vehicle, currentRun(vehicle, runs.value), fleetQuery.value, fleetGroup.value)
      );
    })
    .join("\n");
});
export const shownIds = computed(() => (found.value === "" ? [] : found.value.split("\n")));

export function showAllVehicles(): void {
  fleetQuery.value = "";
  fleetGroup.value = "all";
}
