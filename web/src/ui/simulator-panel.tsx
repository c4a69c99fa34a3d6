import { useState } from "preact/hooks";
import type { SimulatedVehicle, SimulatorView } from "../api/types";
import { altitude, speed } from "../format/units";
import { asSentence, plain } from "../format/words";
import { clearingValue, faultName, lastingFaults, valueText } from "../simulator/faults";
import { may, principal } from "../state/principal";
import { selectVehicle, vehicleId } from "../state/selection";
import { setFault, simulator } from "../state/simulator";
import { live } from "../state/store";
import { FaultRow } from "./fault-row";
import { Icon } from "./icons";
import { SimulatorPace } from "./simulator-pace";

/** The simulated vehicles as they truly are, and what can be made wrong with them. */
export function SimulatorPanel() {
  const view = simulator.value;
  const [all, setAll] = useState(false);
  if (view?.available !== true) return <NoSimulator reason={view?.reason ?? null} />;
  const named = view.vehicles.filter((vehicle) => vehicle.vehicle_id !== null);
  const chosen = named.find((vehicle) => vehicle.vehicle_id === vehicleId.value)?.vehicle_id ?? named[0]?.vehicle_id ?? null;
  const target = all ? null : chosen;
  const choose = (id: string | null) => {
    setAll(id === null);
    if (id !== null) selectVehicle(id);
  };
  return (
    <div class="panel-body simulator">
      <RoleNote />
      {view.speed !== null && <SimulatorPace speed={view.speed} />}
      <section aria-label="Simulated vehicles">
        <ul class="sim-vehicles">
          {view.vehicles.map((vehicle) => (
            <SimVehicle key={vehicle.system_id} view={view} vehicle={vehicle} chosen={target !== null && target === vehicle.vehicle_id} onChoose={() => choose(vehicle.vehicle_id)} />
          ))}
        </ul>
        <button type="button" class="sim-all" aria-pressed={target === null} onClick={() => choose(null)}>
          All simulated vehicles
        </button>
      </section>
      <section aria-labelledby="faults-title">
        <h3 id="faults-title">Faults of {target ?? "all simulated vehicles"}</h3>
        <ul class="faults">
          {view.faults.map((kind) => (
            <FaultRow key={`${kind.fault} ${target}`} kind={kind} target={target} current={lastingFaults(view.vehicles, target)[kind.fault]} />
          ))}
        </ul>
      </section>
    </div>
  );
}

function NoSimulator({ reason }: { reason: string | null }) {
  return (
    <div class="panel-body empty-panel">
      <Icon name="simulator" size={40} />
      <h3>No simulated vehicles</h3>
      <p>{reason === null ? "The service has not answered yet." : asSentence(reason)}</p>
    </div>
  );
}

function RoleNote() {
  const who = principal.value;
  if (who === null || may("pilot")) return null;
  return (
    <p class="role-note" role="note">
      <Icon name="warning" size={16} />
      <span>
        You may look. Faults and the speed are set by a pilot; {who.name} is a {who.role}.
      </span>
    </p>
  );
}

interface VehicleProps {
  view: SimulatorView;
  vehicle: SimulatedVehicle;
  chosen: boolean;
  onChoose: () => void;
}

/** Where it truly is, whatever its link says, and the faults it has now. */
function SimVehicle({ view, vehicle, chosen, onChoose }: VehicleProps) {
  const name = vehicle.vehicle_id ?? `System ${vehicle.system_id}`;
  const facts = [plain(vehicle.landed_state.toLowerCase()), altitude(vehicle.height_m), speed(vehicle.ground_speed_m_s), vehicle.armed ? "armed" : ""];
  return (
    <li class={`sim-vehicle${chosen ? " chosen" : ""}`}>
      <button type="button" aria-pressed={chosen} disabled={vehicle.vehicle_id === null} onClick={onChoose}>
        <b>{name}</b> <small>{vehicle.vehicle_id === null ? "not seen by the service yet" : `${vehicle.type} · system ${vehicle.system_id}`}</small>
        <span class="sim-mode">{vehicle.mode}</span>
        <span class="sim-facts">{facts.filter((fact) => fact !== "").join(" · ")}</span>
      </button>
      <LastingFaults view={view} vehicle={vehicle} name={name} />
    </li>
  );
}

function LastingFaults({ view, vehicle, name }: { view: SimulatorView; vehicle: SimulatedVehicle; name: string }) {
  const faults = Object.entries(vehicle.faults);
  if (faults.length === 0) return null;
  return (
    <ul class="chips" aria-label={`Faults of ${name}`}>
      {faults.map(([fault, value]) => {
        const kind = view.faults.find((known) => known.fault === fault);
        const clear = kind === undefined ? undefined : clearingValue(kind);
        const what = value === true ? faultName(fault) : `${faultName(fault)} ${valueText(value)}`;
        return (
          <li key={fault} class="chip tone-warn" data-fault={fault}>
            {what}
            {clear !== undefined && vehicle.vehicle_id !== null && (
              <button type="button" aria-label={`Clear ${what} of ${name}`} disabled={!live.value || !may("pilot")} onClick={() => void setFault(vehicle.vehicle_id, fault, clear)}>
                <Icon name="close" size={12} />
              </button>
            )}
          </li>
        );
      })}
    </ul>
  );
}
