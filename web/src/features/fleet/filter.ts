/** Which vehicles of a large fleet are looked for. Pure. */

import type { LandedState, Run, Vehicle } from "../../api/types";
import { flightModeLabel, vehicleTypeLabel } from "../../format/labels";

export const FLEET_GROUPS = ["all", "air", "run", "attention"] as const;
export type FleetGroup = (typeof FLEET_GROUPS)[number];

export const FLEET_GROUP_LABELS: Readonly<Record<FleetGroup, string>> = {
  all: "All",
  air: "In the air",
  run: "On a run",
  attention: "Need attention",
};

const LOW_BATTERY_PERCENT = 20;
const AIRBORNE: Readonly<Record<LandedState, boolean>> = {
  undefined: false,
  on_ground: false,
  in_air: true,
  taking_off: true,
  landing: true,
};

/**
 * `run` is the vehicle's open run. Every word of `query` must be found in its id, type, mode, firmware or run's item.
 */
export function matchesFleetFilter(vehicle: Vehicle, run: Run | null, query: string, group: FleetGroup): boolean {
  return isIn(group, vehicle, run) && wordsOf(query).every((word) => said(vehicle, run).includes(word));
}

function isIn(group: FleetGroup, { state, quarantined }: Vehicle, run: Run | null): boolean {
  switch (group) {
    case "all":
      return true;
    case "air":
      return AIRBORNE[state.landed];
    case "run":
      return run !== null;
    case "attention":
      return (
        quarantined !== null ||
        state.in_failsafe ||
        !state.connected ||
        (state.heartbeat_age_s ?? Infinity) > STALE_LINK_S ||
        (state.battery_percent ?? 100) < LOW_BATTERY_PERCENT
      );
  }
}

function said({ id, vehicle_type, firmware, state }: Vehicle, run: Run | null): string {
  return [id, vehicleTypeLabel(vehicle_type), flightModeLabel(state.mode), firmware, run?.item_id, run?.state]
    .filter(Boolean)
    .join(" ")
    .toLowerCase();
}

function wordsOf(query: string): string[] {
  return query
    .toLowerCase()
    .split(/\s+/)
    .filter((word) => word !== "");
}

/** A heartbeat older than this is shown as stale, before the service calls the link lost. */
export const STALE_LINK_S = 2.5;
