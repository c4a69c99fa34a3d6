import { api, type VehicleCommand } from "../../api/client";
import type { FlightMode, Vehicle } from "../../api/types";
import { commandVehicle, reportProblem } from "../../store/notices";
import { hasRole, pilotNote } from "../../store/principal";
import { live } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { RoleNote } from "../../ui/role-note";

/** Commands that every vehicle follows, outside a run: with a run, the run panel has those that fit it. */
export function VehicleActions({ vehicle }: { vehicle: Vehicle }) {
  const actions = availableActions(vehicle.state);
  if (actions.length === 0 || !live.value) return null;
  return (
    <>
      <RoleNote>{pilotNote()}</RoleNote>
      <div class="actions">
        {actions.map((action) => (
          <VehicleAction key={action} vehicle={vehicle.id} action={action} />
        ))}
      </div>
    </>
  );
}

/** For admins: the quarantine also ends by itself when one vehicle is left. */
export function EndQuarantine({ vehicle }: { vehicle: string }) {
  if (!live.value || !hasRole("admin")) return null;
  const send = () =>
    void api.endQuarantine(vehicle).catch((error: unknown) => reportProblem(`End quarantine of ${vehicle}`, error));
  return (
    <div class="actions">
      <HoldButton verb="End quarantine of" vehicle={vehicle} tone="danger" onConfirm={send} />
    </div>
  );
}

const VERBS: Record<VehicleCommand, string> = { hold: "Hold", return: "Return", land: "Land" };

function VehicleAction({ vehicle, action }: { vehicle: string; action: VehicleCommand }) {
  const verb = VERBS[action];
  const send = () => void commandVehicle(`${verb} ${vehicle}`, vehicle, () => api.vehicleAction(vehicle, action));
  return (
    <HoldButton
      verb={verb}
      vehicle={vehicle}
      tone={action === "hold" ? "info" : "warn"}
      disabled={!hasRole("pilot")}
      onConfirm={send}
    />
  );
}

const ARMED: readonly VehicleCommand[] = ["hold", "return", "land"];
const READY: readonly FlightMode[] = ["hold", "mission"];

/**
 * What a vehicle without a run can be told: disarmed only to hold, which takes it out of a mode in which it does not
 * arm.
 */
export function availableActions({ armed, mode }: Pick<Vehicle["state"], "armed" | "mode">): readonly VehicleCommand[] {
  if (armed === true) return ARMED;
  return armed === false && mode !== null && !READY.includes(mode) ? ["hold"] : [];
}
