/** Vehicles that are not heard any more: since when, by the service's clock. */

import { computed } from "@preact/signals";
import type { Run, Vehicle } from "../api/types";
import { now, serviceNow } from "./clock";
import { hasRunEnded, newestRuns } from "./runs";
import { runs, vehicleIds, vehicles, world } from "./store";
import type { World } from "./world";

export interface LinkLoss {
  /** When the vehicle was heard last, in Unix seconds: what is shown of it is from then. Null: unknown. */
  readonly heardAt: number | null;
  /** How long ago that was. */
  readonly age_s: number | null;
}

/** One that is not in the list is not heard: the service may have started again while it flew. */
export function isHeard(vehicle: string): boolean {
  return vehicles.value[vehicle]?.state.connected === true;
}

/** Open runs of vehicles that the service has not heard since it started, the oldest first. */
export const unheardRuns = computed<readonly Run[]>(() =>
  newestRuns(runs.value)
    .filter((run) => !hasRunEnded(run) && !vehicleIds.value.includes(run.vehicle_id))
    .reverse(),
);

/** Null: the link is up. Pure. */
export function linkLossOf(
  vehicle: Vehicle | undefined,
  { measuredAt, serviceAhead_s }: Pick<World, "measuredAt" | "serviceAhead_s">,
  serviceNow_s: number | null,
): LinkLoss | null {
  if (vehicle?.state.connected === true) return null;
  const heartbeat_age_s = vehicle?.state.heartbeat_age_s ?? null;
  if (heartbeat_age_s === null || measuredAt === null || serviceAhead_s === null || serviceNow_s === null)
    return { heardAt: null, age_s: null };
  const heardAt = serviceAhead_s + measuredAt / 1000 - heartbeat_age_s;
  return { heardAt, age_s: Math.max(0, serviceNow_s - heardAt) };
}

/** It follows the page's clock, not each frame of telemetry. */
export function linkLoss(vehicle: string): LinkLoss | null {
  void now.value;
  const known = world.peek();
  return linkLossOf(known.vehicles[vehicle], known, serviceNow(known.serviceAhead_s));
}
