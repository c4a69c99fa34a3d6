import type { ControlMethodName, Vehicle } from "../../api/types";
import { currentRun } from "../../store/runs";
import { runs } from "../../store/store";
import { Icon } from "../../ui/icons";
import { VehicleActions } from "../fleet/vehicle-actions";
import { controlMethod, offboardDetail } from "./capabilities";
import { engaged } from "./control-state";
import { describeLosses, describeTaskControl, isLimited, summarizeCapabilities } from "./labels";

/**
 * For a vehicle that does not follow all of this page: what it does, what not and why, and the commands that it
 * follows.
 */
export function CapabilitiesSection({ vehicle }: { vehicle: Vehicle }) {
  const known = offboardDetail.value;
  if (known === null) return null;
  const abilities = summarizeCapabilities(vehicle.vehicle_type, known.capabilities, known.tasks);
  if (!isLimited(abilities)) return null;
  const inRun = currentRun(vehicle, runs.value) !== null;
  return (
    <section class="abilities" aria-label={`What you can do with ${vehicle.id}`}>
      <h4>What you can do with {vehicle.id} here</h4>
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
                ? "On the Run panel, while it has a run."
                : vehicle.state.armed === true
                  ? "Hold the button to confirm."
                  : `Return and Land need ${vehicle.id} to be armed.`}
            </small>
          </span>
        </li>
      </ul>
      {!inRun && <VehicleActions vehicle={vehicle} />}
      {known.capabilities.some(({ accepted }) => accepted) && (
        <p class="hint">Other setpoints that it accepts are available over the API.</p>
      )}
    </section>
  );
}

/**
 * For a vehicle whose tasks alone move it: that nobody flies it from here, and what becomes of it without this page.
 */
export function TaskControlSection({ vehicle }: { vehicle: string }) {
  const by = controlMethod.value;
  if (by === null) return null;
  return (
    <section class="offboard-note tone-info commanded" aria-label={`How ${vehicle} is controlled`} data-by={by}>
      <b>{vehicle} is controlled by tasks only</b>
      <p>{describeTaskControl(vehicle, by)}</p>
      {engaged.value ? (
        <details>
          <summary>If the page or the connection is lost</summary>
          <Losses vehicle={vehicle} by={by} />
        </details>
      ) : (
        <Losses vehicle={vehicle} by={by} />
      )}
    </section>
  );
}

function Losses({ vehicle, by }: { vehicle: string; by: ControlMethodName }) {
  return (
    <dl class="losses">
      {describeLosses(vehicle, by).map(([who, what]) => (
        <div key={who}>
          <dt>{who}</dt>
          <dd>{what}</dd>
        </div>
      ))}
    </dl>
  );
}
