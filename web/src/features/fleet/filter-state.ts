/** The filter of the fleet list. The map still shows all vehicles. */

import { computed, signal } from "@preact/signals";
import { currentRun } from "../../store/runs";
import { runs, vehicleIds, vehicles } from "../../store/store";
import { FLEET_GROUPS, type FleetGroup, matchesFleetFilter } from "./filter";

const start = new URLSearchParams(location.hash.slice(1));

export const fleetQuery = signal(start.get("find") ?? "");
export const fleetGroup = signal<FleetGroup>(FLEET_GROUPS.find((name) => name === start.get("group")) ?? "all");
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
        matchesFleetFilter(vehicle, currentRun(vehicle, runs.value), fleetQuery.value, fleetGroup.value)
      );
    })
    .join("\n");
});
export const filteredIds = computed(() => (found.value === "" ? [] : found.value.split("\n")));

export function clearFleetFilter(): void {
  fleetQuery.value = "";
  fleetGroup.value = "all";
}
