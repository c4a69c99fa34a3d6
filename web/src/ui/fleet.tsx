import { useComputed } from "@preact/signals";
import type { Run, Vehicle, VehicleState } from "../api/types";
import { api } from "../api/client";
import { age, heading, metres, percent, speed } from "../format/units";
import { landedName, plain, runStateName, runStateTone, vehicleTypeName } from "../format/words";
import { STALE_S } from "../map/features";
import { secondsSince } from "../state/clock";
import { report } from "../state/notices";
import { currentRun } from "../state/runs";
import { selectRun, selectVehicle, selectedVehicle } from "../state/selection";
import { live, runs, vehicleIds, vehicles, world } from "../state/store";
import { Badge } from "./badge";
import { HoldButton } from "./hold-button";
import { Icon, VehicleIcon } from "./icons";

export function Fleet() {
  const ids = vehicleIds.value;
  return (
    <section class="card fleet" aria-labelledby="fleet-title">
      <h2 id="fleet-title">
        Fleet <small>{ids.length}</small>
      </h2>
      {ids.length === 0 ? <NoVehicles /> : <ul class="rows">{ids.map((id) => <VehicleRow key={id} id={id} />)}</ul>}
    </section>
  );
}

function NoVehicles() {
  return <p class="empty">{live.value ? "No vehicle has been seen yet. They appear here as soon as they send a heartbeat." : "The fleet appears here when the service answers."}</p>;
}

function VehicleRow({ id }: { id: string }) {
  const vehicle = useComputed(() => vehicles.value[id]).value; // only this row is drawn when this vehicle changes
  if (!vehicle) return null;
  const selected = selectedVehicle.value?.id === id;
  const run = currentRun(vehicle, runs.value);
  return (
    <li class={`vehicle${selected ? " selected" : ""}`}>
      <button type="button" class="vehicle-main" aria-pressed={selected} onClick={() => selectVehicle(id)}>
        <span class={vehicle.state.armed === true ? "vehicle-icon armed" : "vehicle-icon"} title={vehicle.state.armed === true ? "Armed" : undefined}>
          <VehicleIcon type={vehicle.vehicle_type} />
        </span>
        <span class="vehicle-name">
          <b>{id}</b>
          <small>{vehicleTypeName(vehicle.vehicle_type)}</small>
        </span>
        <VehicleBadges vehicle={vehicle} />
        <span class="vehicle-facts">
          <Landed state={vehicle.state} />
          <Battery value={vehicle.state.battery_percent} />
          <LinkAge vehicle={vehicle} />
        </span>
      </button>
      {vehicle.quarantined !== null && (
        <p class="quarantine">
          <Icon name="warning" size={16} />
          <span>
            <b>Quarantined.</b> {vehicle.quarantined}
          </span>
        </p>
      )}
      {run && <RunLine run={run} />}
      {selected && <VehicleDetails vehicle={vehicle} inRun={run !== null} />}
    </li>
  );
}

function VehicleBadges({ vehicle: { state } }: { vehicle: Vehicle }) {
  return (
    <span class="vehicle-badges">
      {state.in_failsafe && <Badge tone="danger">Failsafe</Badge>}
      <Badge tone={state.mode === "mission" ? "info" : "neutral"}>{state.mode === null ? "No mode" : plain(state.mode)}</Badge>
    </span>
  );
}

/** Armed is only news on the ground; in the air it goes without saying. */
function Landed({ state }: { state: VehicleState }) {
  const ready = state.armed === true && state.landed === "on_ground";
  return <span class={ready ? "landed armed" : "landed"}>{ready ? "Armed" : landedName(state.landed)}</span>;
}

function Battery({ value }: { value: number | null }) {
  const tone = value === null ? "" : value < 20 ? "danger" : value < 35 ? "warn" : "ok";
  return (
    <span class={`battery ${tone}`} aria-label={value === null ? "Battery not known" : `Battery ${percent(value)}`}>
      <span class="battery-body">
        <span style={{ width: `${Math.min(100, value ?? 0)}%` }} />
      </span>
      {percent(value)}
    </span>
  );
}

/** Age of the last heartbeat: what the service measured, and what passed since it said so. */
function LinkAge({ vehicle: { state } }: { vehicle: Vehicle }) {
  const measured = world.value.measuredAt;
  const heartbeat = state.heartbeat_age_s === null || measured === null ? null : state.heartbeat_age_s + secondsSince(measured);
  const tone = !state.connected || heartbeat === null ? "danger" : heartbeat > STALE_S ? "warn" : "ok";
  const text = state.connected ? age(heartbeat) : `lost ${age(heartbeat)}`;
  return (
    <span class={`link-age ${tone}`} aria-label={`Link: last heartbeat ${text} ago`} title="Age of the last heartbeat">
      <Icon name="link" size={14} />
      {text}
    </span>
  );
}

function RunLine({ run }: { run: Run }) {
  return (
    <button type="button" class="run-line" onClick={() => selectRun(run.id)}>
      <Badge tone={runStateTone(run.state)}>{runStateName(run.state)}</Badge>
      <span>{run.item_id ?? ""}</span>
    </button>
  );
}

/** Commands outside a run: with a run, the run panel has those that fit it. */
function VehicleDetails({ vehicle, inRun }: { vehicle: Vehicle; inRun: boolean }) {
  const { state } = vehicle;
  const north = state.velocity_north_m_s;
  const east = state.velocity_east_m_s;
  const ground = north === null || east === null ? null : Math.hypot(north, east);
  const commandable = !inRun && state.armed === true && vehicle.quarantined === null && live.value;
  return (
    <div class="vehicle-details">
      <dl class="facts">
        <Fact name="Altitude" value={metres(state.relative_altitude_m)} />
        <Fact name="Ground speed" value={speed(ground)} />
        <Fact name="Climb" value={speed(state.velocity_down_m_s === null ? null : -state.velocity_down_m_s)} />
        <Fact name="Heading" value={heading(state.heading_deg)} />
        <Fact name="Firmware" value={vehicle.firmware ?? "–"} />
        <Fact name="System id" value={String(vehicle.system_id)} />
      </dl>
      {commandable && (
        <div class="actions">
          <VehicleAction vehicle={vehicle} action="hold" verb="Hold" />
          <VehicleAction vehicle={vehicle} action="return" verb="Return" />
          <VehicleAction vehicle={vehicle} action="land" verb="Land" />
        </div>
      )}
    </div>
  );
}

function VehicleAction({ vehicle, action, verb }: { vehicle: Vehicle; action: "hold" | "return" | "land"; verb: string }) {
  const send = () => void api.vehicleAction(vehicle.id, action).catch((error: unknown) => report(`${verb} ${vehicle.id}`, error));
  return <HoldButton verb={verb} vehicle={vehicle.id} tone={action === "hold" ? "info" : "warn"} onConfirm={send} />;
}

function Fact({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}
