import { useState } from "preact/hooks";
import type { SimulatedVehicle, SimulatorSpeed, SimulatorView } from "../../api/types";
import { humanize, toSentence } from "../../format/text";
import { formatAltitude, formatSpeed } from "../../format/units";
import { hasRole, principal, signedInAs } from "../../store/principal";
import { selectVehicle, showPanel, vehicleId } from "../../store/selection";
import { live } from "../../store/store";
import { Icon } from "../../ui/icons";
import { FaultProblem, FaultRow } from "./fault-row";
import { activeFaults, clearingValue, faultLabel, formatFaultValue } from "./faults";
import { SPEED, setFault, setSpeed, settingFault, simulator } from "./simulator";

/** The simulated vehicles as they truly are, and what can be made wrong with them. */
export function SimulatorPanel() {
  const view = simulator.value;
  const [all, setAll] = useState(false);
  if (view?.available !== true) return <NoSimulator reason={view?.reason ?? null} />;
  const named = view.vehicles.filter((vehicle) => vehicle.vehicle_id !== null);
  const chosen =
    named.find((vehicle) => vehicle.vehicle_id === vehicleId.value)?.vehicle_id ?? named[0]?.vehicle_id ?? null;
  const target = all ? null : chosen;
  const choose = (id: string | null) => {
    setAll(id === null);
    if (id !== null) selectVehicle(id);
  };
  return (
    <div class="panel-body simulator">
      <RoleNote />
      <NextStep view={view} />
      {view.speed !== null && <SpeedControl speed={view.speed} />}
      <section aria-label="Simulated vehicles">
        <ul class="sim-vehicles">
          {view.vehicles.map((vehicle) => (
            <SimVehicle
              key={vehicle.system_id}
              view={view}
              vehicle={vehicle}
              chosen={target !== null && target === vehicle.vehicle_id}
              onChoose={() => choose(vehicle.vehicle_id)}
            />
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
            <FaultRow
              key={`${kind.fault} ${target}`}
              kind={kind}
              target={target}
              current={activeFaults(view.vehicles, target)[kind.fault]}
            />
          ))}
        </ul>
      </section>
    </div>
  );
}

/** Clear what was made wrong, else fly. */
function NextStep({ view }: { view: SimulatorView }) {
  const set = view.faults.filter(({ fault }) => view.vehicles.some(({ faults }) => fault in faults));
  const clearable = set.flatMap((kind) => {
    const clear = clearingValue(kind);
    return clear === undefined ? [] : [[kind.fault, clear] as const];
  });
  if (clearable.length === 0) {
    return (
      <button type="button" class="primary" onClick={() => showPanel("plan")}>
        Plan a flight
      </button>
    );
  }
  const clearAll = async () => {
    for (const [fault, value] of clearable) await setFault(null, fault, value);
  };
  return (
    <button
      type="button"
      class="primary"
      disabled={!live.value || !hasRole("pilot") || settingFault.value !== null}
      onClick={() => void clearAll()}
    >
      Clear all faults
    </button>
  );
}

function NoSimulator({ reason }: { reason: string | null }) {
  return (
    <div class="panel-body empty-panel">
      <Icon name="simulator" size={40} />
      <h3>No simulated vehicles</h3>
      <p>{reason === null ? "Waiting for the service." : toSentence(reason)}</p>
      {reason !== null && (
        <p>
          <b>First step:</b> run <code>waydrop up</code>, which starts the service with simulated vehicles.
        </p>
      )}
      <button type="button" class="primary" onClick={() => showPanel("plan")}>
        Plan a flight
      </button>
    </div>
  );
}

function RoleNote() {
  const who = principal.value;
  if (who === null || hasRole("pilot")) return null;
  return (
    <p class="role-note" role="note">
      <Icon name="warning" size={16} />
      <span>Only a pilot can set faults and the speed. {signedInAs(who)}</span>
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
  const facts = [
    humanize(vehicle.landed_state.toLowerCase()),
    formatAltitude(vehicle.height_m),
    formatSpeed(vehicle.ground_speed_m_s),
    vehicle.armed ? "armed" : "",
  ];
  return (
    <li class={`sim-vehicle${chosen ? " chosen" : ""}`}>
      <button type="button" aria-pressed={chosen} disabled={vehicle.vehicle_id === null} onClick={onChoose}>
        <b>{name}</b>{" "}
        <small>
          {vehicle.vehicle_id === null
            ? "not connected yet"
            : `${airframeLabel(vehicle.type)} · system ${vehicle.system_id}`}
        </small>
        <span class="sim-mode">{modeLabel(vehicle.mode)}</span>
        <span class="sim-facts">{facts.filter((fact) => fact !== "").join(" · ")}</span>
      </button>
      <ActiveFaults view={view} vehicle={vehicle} name={name} />
    </li>
  );
}

const AIRFRAMES: Readonly<Record<string, string>> = {
  quad: "Quadcopter",
  hexa: "Hexacopter",
  plane: "Fixed wing",
  vtol: "VTOL",
};

/** Whatever other airframes the simulator learns keep their name. */
export function airframeLabel(name: string): string {
  return AIRFRAMES[name] ?? humanize(name);
}

/** The simulator tells PX4's own names; PX4 calls Hold AUTO_LOITER. */
function modeLabel(mode: string): string {
  return mode === "LOITER" ? "Hold" : humanize(mode.toLowerCase());
}

function ActiveFaults({ view, vehicle, name }: { view: SimulatorView; vehicle: SimulatedVehicle; name: string }) {
  const faults = Object.entries(vehicle.faults);
  if (faults.length === 0) return null;
  return (
    <ul class="chips" aria-label={`Faults of ${name}`}>
      {faults.map(([fault, value]) => {
        const kind = view.faults.find((known) => known.fault === fault);
        const clear = kind === undefined ? undefined : clearingValue(kind);
        const what = value === true ? faultLabel(fault) : `${faultLabel(fault)} ${formatFaultValue(value)}`;
        return (
          <li key={fault} class="chip tone-warn" data-fault={fault}>
            {what}
            {clear !== undefined && vehicle.vehicle_id !== null && (
              <button
                type="button"
                aria-label={`Clear ${what} of ${name}`}
                disabled={!live.value || !hasRole("pilot")}
                onClick={() => void setFault(vehicle.vehicle_id, fault, clear)}
              >
                <Icon name="close" size={12} />
              </button>
            )}
          </li>
        );
      })}
    </ul>
  );
}

/** How fast the simulated vehicles' time runs, and what that rules out. */
function SpeedControl({ speed }: { speed: SimulatorSpeed }) {
  const disabled = !live.value || !hasRole("pilot") || settingFault.value === SPEED;
  return (
    <section class="sim-speed" aria-labelledby="pace-title">
      <h3 id="pace-title">Simulation speed</h3>
      <div class="sim-speeds" role="group" aria-labelledby="pace-title" aria-describedby="pace-now">
        {SPEEDS.filter((one) => one <= speed.max).map((one) => (
          <button
            key={one}
            type="button"
            aria-pressed={one === speed.wanted}
            aria-label={`${one}×: ${one === 1 ? "real time" : `${one} times real time`}`}
            class={one > speed.live_max ? "beyond" : ""}
            disabled={disabled}
            onClick={() => void setSpeed(one)}
          >
            {one}×
          </button>
        ))}
      </div>
      <p id="pace-now" class={`sim-speed-now tone-${speed.live && !speed.behind ? "neutral" : "warn"}`} role="status">
        {describeSpeed(speed)}
      </p>
      <FaultProblem fault={SPEED} />
    </section>
  );
}

// The speed of simulated time in words. Pure.

/** What is offered: up to 4 for all, above for embedded missions. The API takes all between. */
const SPEEDS: readonly number[] = [1, 2, 4, 10, 20, 50];

export function describeSpeed({ wanted, achieved, behind, live, live_max: most }: SimulatorSpeed): string {
  const runs =
    wanted === 1 ? "Simulated time runs in real time." : `Simulated time runs at ${times(wanted)} real time.`;
  const slow =
    behind && achieved !== null
      ? ` This computer reaches only ${times(achieved)}: flights are the same, but take longer.`
      : "";
  const cap = live
    ? ` Above ${times(most)}, supervised drops and manual control are refused.`
    : ` Supervised drops and manual control are refused above ${times(most)}: only embedded missions fly now.`;
  return runs + slow + cap;
}

function times(factor: number): string {
  return `${Number(factor.toFixed(1))}×`;
}
