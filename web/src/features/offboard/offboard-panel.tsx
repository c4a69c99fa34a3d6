import type { ComponentChildren, RefObject } from "preact";
import { useLayoutEffect, useRef } from "preact/hooks";
import { humanize } from "../../format/text";
import { unheardRuns } from "../../store/link-loss";
import { selectVehicle } from "../../store/selection";
import { vehicleIds } from "../../store/store";
import { SelectField } from "../../ui/fields";
import { Icon } from "../../ui/icons";
import { activity, WARN_AFTER_MS } from "./activity";
import { tasksOnly } from "./capabilities";
import { CapabilitiesSection, TaskControlSection } from "./capabilities-section";
import {
  controlledVehicle,
  controlsShown,
  engaged,
  heldKeys,
  manualControl,
  offboardState,
  steering,
} from "./control-state";
import { isFlightKey, NO_KEYS, pressKey } from "./controls";
import { ControlsSection, ControlTabs, ExitButtons } from "./controls-section";
import { EntrySection } from "./entry-section";
import { ENTRY_STEPS } from "./labels";
import { LeaseSection, OfferSection } from "./lease-section";
import { Readout } from "./readout";
import { RefusalNote } from "./refusal";
import type { Phase } from "./session";

const FIELDS = "input, select, textarea";

/** Offboard control. Its keys count only while the focus is in here, and the controls are engaged and shown. */
export function OffboardPanel({ tasks }: { tasks: (vehicle: string) => ComponentChildren }) {
  const root = useRef<HTMLDivElement>(null);
  const { phase } = manualControl.value;
  useFocusAtControls(root, phase);
  const vehicle = controlledVehicle.value;
  if (vehicle === null) return <NoVehicle />;
  const look = !engaged.value ? "" : controlsShown.value ? "engaged on-controls" : "engaged on-tasks";
  const name = tasksOnly.value ? `Task control of ${vehicle.id}` : `Manual control of ${vehicle.id}`;
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
      {steering.value && activity.value === "warned" && <InputWarning vehicle={vehicle.id} />}
      <PhaseSection vehicle={vehicle.id} />
      {engaged.value && <ExitButtons vehicle={vehicle.id} />}
      {engaged.value && !tasksOnly.value && <ControlTabs />}
      {!controlsShown.value && tasks(vehicle.id)}
      <Readout />
      {controlsShown.value && <ControlsSection vehicle={vehicle.id} />}
      {tasksOnly.value && <TaskControlSection vehicle={vehicle.id} />}
      {(phase === "leased" || phase === "flying") && <OfferSection vehicle={vehicle.id} />}
      {phase === "off" && <CapabilitiesSection vehicle={vehicle} />}
    </div>
  );
}

/** While it is flown the focus is in the panel, else its keys mean nothing. */
function useFocusAtControls(root: RefObject<HTMLDivElement | null>, phase: Phase): void {
  useLayoutEffect(() => {
    if (phase !== "entering" && phase !== "flying") return;
    // an entry: the pilot is at the controls
    if (phase === "flying" && root.current?.contains(document.activeElement)) return;
    root.current?.focus(); // the button that started it was removed
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
      return <LeaseSection vehicle={vehicle} />;
    case "opening":
      return <p role="status">Taking the lease of {vehicle}…</p>;
    case "leased":
      return <EntrySection vehicle={vehicle} />;
    case "entering":
    case "leaving":
      return <EntrySteps />;
    case "silent":
      return <ControlLostNote vehicle={vehicle} />;
    case "flying":
      return null;
  }
}

function onKeyDown(event: KeyboardEvent): void {
  if (!controlsShown.value || (event.target instanceof Element && event.target.closest(FIELDS) !== null)) return;
  heldKeys.value = pressKey(heldKeys.value, event);
  // else the panel scrolls
  if (isFlightKey(event.code) && !event.ctrlKey && !event.altKey && !event.metaKey) event.preventDefault();
}

/** Keys count only in here: held keys are released when the focus leaves, also to the map. */
function onFocusOut({ currentTarget, relatedTarget }: FocusEvent): void {
  const stays = relatedTarget instanceof Node && (currentTarget as Node).contains(relatedTarget);
  if (!stays) heldKeys.value = NO_KEYS;
}

function Head() {
  const vehicle = controlledVehicle.value;
  if (vehicle === null) return null;
  const state = offboardState.value?.state ?? "idle";
  const on = engaged.value && state === "active";
  const off = state === "idle" || manualControl.value.phase === "silent";
  return (
    <header class="offboard-head">
      <h3>{tasksOnly.value ? `${vehicle.id}: task control` : `${vehicle.id}: manual control`}</h3>
      <span class={`offboard-state ${on ? "on" : ""}`} role="status">
        {on ? onLabel() : off ? offLabel() : humanize(state)}
      </span>
      {tasksOnly.value && engaged.value && <small class="offboard-how">Controlled by tasks only</small>}
    </header>
  );
}

function onLabel(): string {
  return manualControl.value.source === "tasks" ? "Flying tasks" : "Manual control on";
}

function offLabel(): string {
  return tasksOnly.value ? "Task control off" : "Manual control off";
}

/** Before controls that have not moved for long count as unattended. */
function InputWarning({ vehicle }: { vehicle: string }) {
  return (
    <div class="offboard-note tone-warn" role="alert">
      <b>Are you still there?</b>
      <p>
        There was no input for {WARN_AFTER_MS / 1000} s. Press a key, or move the mouse or a stick. After a minute
        without input, {vehicle} holds.
      </p>
    </div>
  );
}

function ControlLostNote({ vehicle }: { vehicle: string }) {
  return (
    <div class="offboard-note tone-warn" role="alert">
      <b>Manual control off</b>
      <p>
        {manualControl.value.ended} The page stopped sending setpoints: {vehicle} stops, then holds.
      </p>
    </div>
  );
}

/** On a narrow page neither the fleet nor the map is beside this panel: the vehicle is chosen here too. */
function NoVehicle() {
  const ids = vehicleIds.value;
  const [first] = ids;
  return (
    <div class="panel-body empty-panel">
      <Icon name="joystick" size={40} />
      <h3>No vehicle selected</h3>
      {first === undefined && unheardRuns.value.length > 0 ? (
        <p>No vehicle has been heard since the service started, although a run is open.</p>
      ) : first === undefined ? (
        <p>
          No vehicle has connected yet. <b>First step:</b> run <code>waydrop up</code> for simulated vehicles, or send
          the MAVLink of yours to this service.
        </p>
      ) : (
        <>
          <p>Select the vehicle to control here, in the fleet or on the map.</p>
          <button type="button" class="primary" onClick={() => selectVehicle(first)}>
            Select {first}
          </button>
          <SelectField name="Vehicle to control" value="" onChange={selectVehicle}>
            <option value="" disabled>
              Select…
            </option>
            {ids.map((id) => (
              <option key={id} value={id}>
                {id}
              </option>
            ))}
          </SelectField>
        </>
      )}
    </div>
  );
}

/** How far an entry is. */
function EntrySteps() {
  if (manualControl.value.phase === "leaving") return <p role="status">Leaving…</p>;
  const now = ENTRY_STEPS.findIndex(([state]) => state === offboardState.value?.state);
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
