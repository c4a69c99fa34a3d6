import type { FlownBy, Vehicle } from "../../api/types";
import { currentRun } from "../../store/runs";
import { runs } from "../../store/store";
import { Icon } from "../../ui/icons";
import { VehicleActions } from "../fleet/vehicle-actions";
import { detail, flownBy } from "./capabilities";
import { engaged } from "./control-state";
import { abilitiesOf, commandedWords, goneWords, isLimited } from "./labels";

/**
 * For a vehicle that does not follow all of this page: what it does, what not and why, and the commands that it
 * follows.
 */
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
            <small>
              {inRun
                ? "The run panel has those that fit its run."
                : vehicle.state.armed === true
                  ? "Held to confirm."
                  : `Return and land as soon as ${vehicle.id} is armed.`}
            </small>
          </span>
        </li>
      </ul>
      {!inRun && <VehicleActions vehicle={vehicle} />}
      {known.capabilities.some(({ taken }) => taken) && (
        <p class="hint">Programs can send it the other setpoints that it follows (docs/reference/offboard.md).</p>
      )}
    </section>
  );
}

/**
 * For a vehicle whose tasks alone move it: that nobody flies it from here, and what becomes of it without this page.
 */
export function OffboardCommanded({ vehicle }: { vehicle: string }) {
  const by = flownBy.value;
  if (by === null) return null;
  return (
    <section class="offboard-note tone-info commanded" aria-label={`How ${vehicle} is commanded`} data-by={by}>
      <b>{vehicle} is commanded, not under manual control</b>
      <p>{commandedWords(vehicle, by)}</p>
      {engaged.value ? (
        <details>
          <summary>When this page goes away</summary>
          <Gone vehicle={vehicle} by={by} />
        </details>
      ) : (
        <Gone vehicle={vehicle} by={by} />
      )}
    </section>
  );
}

function Gone({ vehicle, by }: { vehicle: string; by: FlownBy }) {
  return (
    <dl class="gone">
      {goneWords(vehicle, by).map(([who, what]) => (
        <div key={who}>
          <dt>{who}</dt>
          <dd>{what}</dd>
        </div>
      ))}
    </dl>
  );
}
