import { api } from "../api/client";
import type { Vehicle } from "../api/types";
import { report } from "../state/notices";
import { live } from "../state/store";
import { HoldButton } from "./hold-button";

/** Commands that every vehicle follows, outside a run: with a run, the run panel has those that fit it. */
export function VehicleActions({ vehicle }: { vehicle: Vehicle }) {
  if (vehicle.state.armed !== true || vehicle.quarantined !== null || !live.value) return null;
  return (
    <div class="actions">
      <VehicleAction vehicle={vehicle.id} action="hold" verb="Hold" />
      <VehicleAction vehicle={vehicle.id} action="return" verb="Return" />
      <VehicleAction vehicle={vehicle.id} action="land" verb="Land" />
    </div>
  );
}

function VehicleAction({ vehicle, action, verb }: { vehicle: string; action: "hold" | "return" | "land"; verb: string }) {
  const send = () => void api.vehicleAction(vehicle, action).catch((error: unknown) => report(`${verb} ${vehicle}`, error));
  return <HoldButton verb={verb} vehicle={vehicle} tone={action === "hold" ? "info" : "warn"} onConfirm={send} />;
}
