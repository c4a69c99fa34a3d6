/** Vehicles that are not heard any more: since when, by the service's clock. */

import type { Vehicle } from "../api/types";
import { now, serviceNow } from "./clock";
import { world } from "./store";
import type { World } from "./world";

export interface LinkLoss {
  /** When the vehicle was heard last, in Unix seconds: what is shown of it is from then. Null: unknown. */
  readonly heardAt: number | null;
  /** How long ago that was. */
  readonly age_s: number | null;
}

/** Null: the link is up, or the vehicle unknown. Pure. */
export function linkLossOf(
  vehicle: Vehicle | undefined,
  { measuredAt, serviceAhead_s }: Pick<World, "measuredAt" | "serviceAhead_s">,
  serviceNow_s: number | null,
): LinkLoss | null {
  if (vehicle === undefined || vehicle.state.connected) return null;
  const { heartbeat_age_s } = vehicle.state;
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
