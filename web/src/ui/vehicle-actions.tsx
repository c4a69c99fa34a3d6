import { api } from "../api/client";
import type { Vehicle } from "../api/types";
import { type Action, actionsOf } from "../fleet/actions";
import { report } from "../state/notices";
import { live } from "../state/store";
import { HoldButton } from "./hold-button";

/** Commands that every vehicle follows, outside a run: with a run, the run panel has those that fit it. */
export function VehicleActions({ vehicle }: { vehicle: Vehicle }) {
  const actions = actionsOf(vehicle.state);
  if (actions.length === 0 || vehicle.quarantined !== null || !live.value) return null;
  return (
    <div class="actions">
      {actions.map((action) => (
        <VehicleAction key={action} vehicle={vehicle.id} action={action} />
      ))}
    </div>
  );
}

const VERBS: Record<Action, string> = { hold: "Hold", return: "Return", land: "Land" };

function VehicleAction({ vehicle, action }: { vehicle: string; action: Action }) {
  const verb = VERBS[action];
  const send = () => void api.vehicleAction(vehicle, action).catch((error: unknown) => report(`${verb} ${vehicle}`, error));
  return <HoldButton verb={verb} vehicle={vehicle} tone={action === "hold" ? "info" : "warn"} onConfirm={send} />;
}
