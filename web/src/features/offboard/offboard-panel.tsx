import type { ComponentChildren, RefObject } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { plain } from "../../format/labels";
import { selectVehicle } from "../../store/selection";
import { vehicleIds } from "../../store/store";
import { Choice } from "../../ui/fields";
import { Icon } from "../../ui/icons";
import { attendance, WARN_AFTER_MS } from "./attendance";
import { tasksOnly } from "./capabilities";
import { OffboardAbilities, OffboardCommanded } from "./capabilities-section";
import { byControls, controlledVehicle, engaged, held, manualControl, offboardNow, steering } from "./control-state";
import { flies, NONE_HELD, pressed } from "./controls";
import { OffboardControls, OffboardPages, WaysOut } from "./controls-section";
import { OffboardEntry } from "./entry-section";
import { ENTRY_STEPS } from "./labels";
import { OffboardLease, OffboardOffer } from "./lease-section";
import { OffboardReadout } from "./readout";
import { RefusalNote } from "./refusal";
import type { Phase } from "./session";

const FIELDS = "input, select, textarea";

/** Offboard control. Its keys count only while the focus is in here, and the controls are engaged and shown. */
export function OffboardPanel({ tasks }: { tasks: (vehicle: string) => ComponentChildren }) {
  const root = useRef<HTMLDivElement>(null);
  const { phase } = manualControl.value;
  useFocusAtControls(root, phase);
  const vehicle = controlledVehicle.value;
  if (vehicle === null) return <OffboardNoVehicle />;
  const look = !engaged.value ? "" : byControls.value ? "engaged on-controls" : "engaged on-tasks";
  const name = tasksOnly.value ? `Command ${vehicle.id} by tasks` : `Control ${vehicle.id} manually`;
  return (
    <div
      class={`panel-body offboard ${look}`}
      data-phase={phase}
      data-controls={!tasksOnly.value}
      role="group"
      aria-label={name}
      tabIndex={-1}
      ref={root}
      onKeyDown={onKeyDown}
      onFocusOut={onFocusOut}
    >
      <Head />
      {manualControl.value.refusal !== null && <RefusalNote refusal={manualControl.value.refusal} />}
      {steering.value && attendance.value === "warned" && <IsAnybodyThere vehicle={vehicle.id} />}
      <PhaseSection vehicle={vehicle.id} />
      {engaged.value && <WaysOut vehicle={vehicle.id} />}
      {engaged.value && !tasksOnly.value && <OffboardPages />}
      {!byControls.value && tasks(vehicle.id)}
      <OffboardReadout />
      {byControls.value && <OffboardControls vehicle={vehicle.id} />}
      {tasksOnly.value && <OffboardCommanded vehicle={vehicle.id} />}
      {(phase === "leased" || phase === "flying") && <OffboardOffer vehicle={vehicle.id} />}
      {phase === "off" && <OffboardAbilities vehicle={vehicle} />}
    </div>
  );
}

/** While it is flown the focus is in the panel, else its keys mean nothing. */
function useFocusAtControls(root: RefObject<HTMLDivElement | null>, phase: Phase): void {
  useLayoutEffect(() => {
    if (phase !== "entering" && phase !== "flying") return;
    // an entry: the pilot is at the controls
    if (phase === "flying" && root.current?.contains(document.activeElement)) return;
    root.current?.focus(); // the button that began it is gone
    root.current?.scrollIntoView({ block: "start" });
  }, [phase]);
  useLayoutEffect(() => {
    // a button went away by itself
    if (engaged.value && document.activeElement === document.body) root.current?.focus();
  });
}

/** What there is to do in this phase. */
function PhaseSection({ vehicle }: { vehicle: string }) {
  switch (manualControl.value.phase) {
    case "off":
      return <OffboardLease vehicle={vehicle} />;
    case "opening":
      return <p role="status">Asking for the lease of {vehicle}…</p>;
    case "leased":
      return <OffboardEntry vehicle={vehicle} />;
    case "entering":
    case "leaving":
      return <OffboardSteps />;
    case "silent":
      return <ControlLostNote vehicle={vehicle} />;
    case "flying":
      return null;
  }
}

function onKeyDown(event: KeyboardEvent): void {
  if (!byControls.value || (event.target instanceof Element && event.target.closest(FIELDS) !== null)) return;
  held.value = pressed(held.value, event);
  // else the panel scrolls
  if (flies(event.code) && !event.ctrlKey && !event.altKey && !event.metaKey) event.preventDefault();
}

/** Keys count only in here: none that is down goes on counting when the focus goes elsewhere, to the map too. */
function onFocusOut({ currentTarget, relatedTarget }: FocusEvent): void {
  const stays = relatedTarget instanceof Node && (currentTarget as Node).contains(relatedTarget);
  if (!stays) held.value = NONE_HELD;
}

function Head() {
  const vehicle = controlledVehicle.value;
  if (vehicle === null) return null;
  const state = offboardNow.value?.state ?? "idle";
  const on = engaged.value && state === "active";
  const off = state === "idle" || manualControl.value.phase === "silent";
  return (
    <header class="offboard-head">
      <h3>{tasksOnly.value ? `${vehicle.id} by tasks` : `${vehicle.id}: manual control`}</h3>
      <span class={`offboard-state ${on ? "on" : ""}`} role="status">
        {on
          ? manualControl.value.leads === "tasks"
            ? "Flies tasks"
            : "Manual control on"
          : off
            ? tasksOnly.value
              ? "Not commanded"
              : "Manual control off"
            : plain(state)}
      </span>
      {tasksOnly.value && engaged.value && <small class="offboard-how">Commanded, not under manual control</small>}
    </header>
  );
}

/** Before controls that have not moved for long count as unattended. */
function IsAnybodyThere({ vehicle }: { vehicle: string }) {
  return (
    <div class="offboard-note tone-warn" role="alert">
      <b>Is anybody there?</b>
      <p>
        Nothing was touched for {WARN_AFTER_MS / 1000} s. Press a key or move the mouse or a stick: after a minute
        nothing is sent any more, and {vehicle} holds.
      </p>
    </div>
  );
}

function ControlLostNote({ vehicle }: { vehicle: string }) {
  return (
    <div class="offboard-note tone-warn" role="alert">
      <b>Manual control off</b>
      <p>
        {manualControl.value.ended} Nothing is sent to {vehicle} any more: it stands still, then holds.
      </p>
    </div>
  );
}

/** On a narrow page neither the fleet nor the map is beside this panel: the vehicle is chosen here too. */
export function OffboardNoVehicle() {
  const ids = vehicleIds.value;
  return (
    <div class="panel-body empty-panel">
      <Icon name="joystick" size={40} />
      <h3>No vehicle chosen</h3>
      {ids.length === 0 ? (
        <p>No vehicle has been seen yet.</p>
      ) : (
        <>
          <p>Choose the vehicle to control, here, in the fleet or on the map.</p>
          <Choice name="Vehicle to fly" value="" onChange={selectVehicle}>
            <option value="" disabled>
              Choose…
            </option>
            {ids.map((id) => (
              <option key={id} value={id}>
                {id}
              </option>
            ))}
          </Choice>
        </>
      )}
    </div>
  );
}

/** How far an entry is. */
export function OffboardSteps() {
  if (manualControl.value.phase === "leaving") return <p role="status">Leaving…</p>;
  const now = ENTRY_STEPS.findIndex(([state]) => state === offboardNow.value?.state);
  return (
    <ol class="steps" aria-label="Entry">
      {ENTRY_STEPS.map(([state, name], i) => (
        <li key={state} class={i < now ? "done" : i === now ? "current" : ""}>
          {name}
        </li>
      ))}
    </ol>
  );
}
