import { useComputed } from "@preact/signals";
import type { FlightMode, LandedState, Reason, Run, Vehicle, VehicleType } from "../../api/types";
import {
  flightModeLabel,
  flightModeTone,
  landedLabel,
  linkSecurityLabel,
  runStateLabel,
  runStateTone,
  vehicleTypeLabel,
} from "../../format/labels";
import { formatReason } from "../../format/reasons";
import {
  formatAltitude,
  formatClimbRate,
  formatHeading,
  formatLinkAge,
  formatPercent,
  formatSpeed,
} from "../../format/units";
import { now, secondsSince } from "../../store/clock";
import { unheardRuns } from "../../store/link-loss";
import { planName } from "../../store/plans";
import { currentRun } from "../../store/runs";
import { selectedVehicle, selectRun, selectVehicle } from "../../store/selection";
import { live, runs, vehicleIds, vehicles, world } from "../../store/store";
import { Badge } from "../../ui/badge";
import { Icon, VehicleIcon } from "../../ui/icons";
import { useStableComputed } from "../../ui/use-stable-computed";
import { FLEET_GROUP_LABELS, FLEET_GROUPS, STALE_LINK_S } from "./filter";
import { clearFleetFilter, filteredIds, fleetGroup, fleetQuery, isFiltered } from "./filter-state";
import { EndQuarantine, VehicleActions } from "./vehicle-actions";

export function FleetList() {
  const ids = filteredIds.value;
  return (
    <section class="card fleet" aria-labelledby="fleet-title">
      <h2 id="fleet-title">
        Fleet <small>{isFiltered.value ? `${ids.length} of ${vehicleIds.value.length}` : ids.length}</small>
      </h2>
      <FleetSearch />
      <UnheardRuns />
      {ids.length === 0 ? (
        <NoVehicles />
      ) : (
        <ul class="rows">
          {ids.map((id) => (
            <VehicleRow key={id} id={id} />
          ))}
        </ul>
      )}
    </section>
  );
}

function NoVehicles() {
  if (isFiltered.value && vehicleIds.value.length > 0) {
    return (
      <div class="empty">
        <p>No vehicle matches.</p>
        <button type="button" class="small" onClick={clearFleetFilter}>
          Show all {vehicleIds.value.length}
        </button>
      </div>
    );
  }
  if (unheardRuns.value.length > 0) return null;
  if (!live.value) return <p class="empty">Waiting for the service.</p>;
  return (
    <div class="empty">
      <p>No vehicle has connected yet. Vehicles appear here with their first heartbeat.</p>
      <p>
        <b>First step:</b> run <code>waydrop up</code> for simulated vehicles, or send the MAVLink of yours to this
        service.
      </p>
    </div>
  );
}

/** They may be in flight, although nothing is known of the vehicle. */
function UnheardRuns() {
  if (unheardRuns.value.length === 0) return null;
  return (
    <section class="unheard" aria-label="Vehicles not heard">
      <p>Not heard since the service started, with an open run:</p>
      <ul>
        {unheardRuns.value.map((run) => (
          <li key={run.id}>
            <b>{run.vehicle_id}</b>
            <RunLine run={run} />
          </li>
        ))}
      </ul>
    </section>
  );
}

function VehicleRow({ id }: { id: string }) {
  // drawn when what it says has changed, not with each frame
  const vehicle = useStableComputed(() => rowOf(vehicles.value[id])).value;
  const selected = selectedVehicle.value?.id === id;
  if (vehicle === null) return null;
  return (
    <li class={`vehicle${selected ? " selected" : ""}`}>
      <button type="button" class="vehicle-main" aria-pressed={selected} onClick={() => selectVehicle(id)}>
        <span class={vehicle.armed ? "vehicle-icon armed" : "vehicle-icon"} title={vehicle.armed ? "Armed" : undefined}>
          <VehicleIcon type={vehicle.type} />
        </span>
        <span class="vehicle-name">
          <b>{id}</b>
          <small>{vehicleTypeLabel(vehicle.type)}</small>
        </span>
        <VehicleBadges row={vehicle} />
        <span class="vehicle-facts">
          <Landed row={vehicle} />
          <Battery value={vehicle.battery_percent} />
          <LinkAge id={id} />
        </span>
      </button>
      {vehicle.quarantined !== null && (
        <p class="quarantine">
          <Icon name="warning" size={16} />
          <span>
            <b>Quarantined:</b> {formatReason(vehicle.quarantined)}
          </span>
        </p>
      )}
      <RunOf id={id} />
      {selected && <VehicleDetails id={id} />}
    </li>
  );
}

/** What a row says, as coarse as it says it. */
interface Row {
  readonly type: VehicleType | null;
  readonly quarantined: Reason | null;
  readonly mode: FlightMode | null;
  readonly failsafe: boolean;
  readonly armed: boolean;
  readonly landed: LandedState;
  readonly battery_percent: number | null;
}

function rowOf(vehicle: Vehicle | undefined): Row | null {
  if (vehicle === undefined) return null;
  const { mode, in_failsafe, armed, landed, battery_percent } = vehicle.state;
  const battery = battery_percent === null ? null : Math.round(battery_percent);
  return {
    type: vehicle.vehicle_type,
    quarantined: vehicle.quarantined,
    mode,
    failsafe: in_failsafe,
    armed: armed === true,
    landed,
    battery_percent: battery,
  };
}

function VehicleBadges({ row }: { row: Row }) {
  return (
    <span class="vehicle-badges">
      {row.failsafe && <Badge tone="danger">Failsafe</Badge>}
      <Badge tone={flightModeTone(row)}>{flightModeLabel(row.mode)}</Badge>
    </span>
  );
}

/** Armed is only news on the ground; in the air it goes without saying. */
function Landed({ row }: { row: Row }) {
  const ready = row.armed && row.landed === "on_ground";
  return <span class={ready ? "landed armed" : "landed"}>{ready ? "Armed" : landedLabel(row.landed)}</span>;
}

function Battery({ value }: { value: number | null }) {
  const tone = value === null ? "" : value < 20 ? "danger" : value < 35 ? "warn" : "ok";
  return (
    <span
      class={`battery ${tone}`}
      role="img"
      aria-label={value === null ? "Battery unknown" : `Battery ${formatPercent(value)}`}
    >
      <span class="battery-body">
        <span style={{ width: `${Math.min(100, value ?? 0)}%` }} />
      </span>
      {formatPercent(value)}
    </span>
  );
}

/** Age of the last heartbeat: as reported, and the time since that report. Updates with the clock. */
function LinkAge({ id }: { id: string }) {
  const { tone, text } = useStableComputed(() => {
    void now.value;
    return linkOf(vehicles.peek()[id], world.peek().measuredAt);
  }).value;
  return (
    <span
      class={`link-age ${tone}`}
      role="img"
      aria-label={`Link: last heartbeat ${text} ago`}
      title="Age of the last heartbeat"
    >
      <Icon name="link" size={14} />
      {text}
    </span>
  );
}

function linkOf(vehicle: Vehicle | undefined, measured: number | null): { tone: string; text: string } {
  const reported = vehicle?.state.heartbeat_age_s ?? null;
  const heartbeat = reported === null || measured === null ? null : reported + secondsSince(measured);
  const connected = vehicle?.state.connected === true;
  const tone = !connected || heartbeat === null ? "danger" : heartbeat > STALE_LINK_S ? "warn" : "ok";
  return { tone, text: connected ? formatLinkAge(heartbeat) : `lost ${formatLinkAge(heartbeat)}` };
}

function RunOf({ id }: { id: string }) {
  const run = useComputed(() => {
    const vehicle = vehicles.value[id];
    return vehicle === undefined ? null : currentRun(vehicle, runs.value);
  }).value;
  return run === null ? null : <RunLine run={run} />;
}

function RunLine({ run }: { run: Run }) {
  return (
    <button type="button" class="run-line" onClick={() => selectRun(run.id)}>
      <Badge tone={runStateTone(run.state)}>{runStateLabel(run.state)}</Badge>
      <span>{run.item_id ?? planName(run.plan_id) ?? ""}</span>
    </button>
  );
}

/** Commands outside a run: with a run, the run panel has those that fit it. */
function VehicleDetails({ id }: { id: string }) {
  const vehicle = vehicles.value[id];
  if (vehicle === undefined) return null;
  const { state } = vehicle;
  const inRun = currentRun(vehicle, runs.value) !== null;
  const north = state.velocity_north_m_s;
  const east = state.velocity_east_m_s;
  const ground = north === null || east === null ? null : Math.hypot(north, east);
  return (
    <div class="vehicle-details">
      <dl class={state.connected ? "facts" : "facts stale"}>
        <Fact name="Altitude" value={formatAltitude(state.relative_altitude_m)} />
        <Fact name="Ground speed" value={formatSpeed(ground)} />
        <Fact
          name="Climb"
          value={formatClimbRate(state.velocity_down_m_s === null ? null : -state.velocity_down_m_s)}
        />
        <Fact name="Heading" value={formatHeading(state.heading_deg)} />
        <Fact name="Firmware" value={vehicle.firmware ?? "–"} />
        <Fact name="System id" value={String(vehicle.system_id)} />
        <Fact name="Link accepts" value={linkSecurityLabel(state.link_security)} />
      </dl>
      {!inRun && <VehicleActions vehicle={vehicle} />}
      {vehicle.quarantined !== null && <EndQuarantine vehicle={id} />}
    </div>
  );
}

function Fact({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

/** Find vehicles by words, or by what they are doing. */
function FleetSearch() {
  return (
    <div class="fleet-search" role="search" aria-label="Fleet search">
      <input
        type="search"
        aria-label="Search the fleet"
        placeholder="Search…"
        autocomplete="off"
        spellcheck={false}
        value={fleetQuery.value}
        onInput={(event) => (fleetQuery.value = event.currentTarget.value)}
      />
      <select
        class="small"
        aria-label="Filter the fleet"
        value={fleetGroup.value}
        onChange={(event) =>
          (fleetGroup.value = FLEET_GROUPS.find((group) => group === event.currentTarget.value) ?? "all")
        }
      >
        {FLEET_GROUPS.map((group) => (
          <option key={group} value={group}>
            {FLEET_GROUP_LABELS[group]}
          </option>
        ))}
      </select>
    </div>
  );
}
