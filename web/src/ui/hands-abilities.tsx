import type { Vehicle } from "../api/types";
import { abilitiesOf, isLimited } from "../hands-on/abilities";
import { detail } from "../state/offboard-facts";
import { currentRun } from "../state/runs";
import { runs } from "../state/store";
import { Icon } from "./icons";
import { VehicleActions } from "./vehicle-actions";

/** For a vehicle that does not follow all of this page: what it does, what not and why, and the commands that it follows. */
export function OffboardAbilities({ vehicle }: { vehicle: Vehicle }) {
  const known = detail.value;
  if (known === null) return null;
  const abilities = abilitiesOf(vehicle.vehicle_type, known.capabilities, known.tasks);
  if (!isLimited(abilities)) return null;
  const inRun = currentRun(vehicle, runs.value) !== null;
  return (
    <section class="abilities" aria-label={`What ${vehicle.id} follows`}>
      <h4>What {vehicle.id} follows from this page</h4>
      <ul>
        {abilities.map(({ name, can, why }) => (
          <li key={name} class={can ? "can" : "cannot"}>
            <Icon name={can ? "check" : "minus"} size={16} />
            <span>
              <b>{name}</b>
              <span class="visually-hidden">{can ? ": yes" : ": no"}</span>
              {why !== "" && <small>{why}</small>}
            </span>
          </li>
        ))}
        <li class="can">
          <Icon name="check" size={16} />
          <span>
            <b>Hold, return and land</b>
            <small>{inRun ? "The run panel has those that fit its run." : vehicle.state.armed === true ? "Held to confirm." : `Return and land as soon as ${vehicle.id} is armed.`}</small>
          </span>
        </li>
      </ul>
      {!inRun && <VehicleActions vehicle={vehicle} />}
      {known.capabilities.some(({ taken }) => taken) && <p class="hint">Programs can send it the other setpoints that it follows (docs/offboard.md).</p>}
    </section>
  );
}
