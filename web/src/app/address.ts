/** The address holds what is shown (#vehicle=v1&run=r7&panel=run), so that a reload or a link shows it again. */

import { effect } from "@preact/signals";
import { fleetGroup, fleetQuery } from "../features/fleet/filter-state";
import { panel, runId, vehicleId, view } from "../store/selection";

export function syncAddress(): void {
  effect(() => {
    const hash = new URLSearchParams();
    if (vehicleId.value !== null) hash.set("vehicle", vehicleId.value);
    if (runId.value !== null) hash.set("run", runId.value);
    if (fleetQuery.value.trim() !== "") hash.set("find", fleetQuery.value.trim());
    if (fleetGroup.value !== "all") hash.set("group", fleetGroup.value);
    hash.set("panel", panel.value);
    hash.set("view", view.value);
    history.replaceState(null, "", `#${hash}`);
  });
}
