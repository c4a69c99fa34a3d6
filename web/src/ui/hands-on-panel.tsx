import { useLayoutEffect, useRef } from "preact/hooks";
import { flies, NONE_HELD, pressed } from "../hands-on/keys";
import { WARN_AFTER_MS } from "../hands-on/presence";
import { plain } from "../format/words";
import { held } from "../state/controls";
import { byControls, engaged, handsOn, handsVehicle, offboardNow, steering } from "../state/hands-on";
import { tasksOnly } from "../state/offboard-facts";
import { attendance } from "../state/presence";
import { HandsAbilities } from "./hands-abilities";
import { HandsCommanded } from "./hands-commanded";
import { HandsControls, WaysOut } from "./hands-controls";
import { HandsEntry } from "./hands-entry";
import { HandsLease } from "./hands-lease";
import { HandsNoVehicle } from "./hands-no-vehicle";
import { HandsOffer } from "./hands-offer";
import { HandsPages } from "./hands-pages";
import { HandsReadout } from "./hands-readout";
import { HandsSteps } from "./hands-steps";
import { HandsTasks } from "./hands-tasks";
import { RefusalNote } from "./refusal-note";

const FIELDS = "input, select, textarea";

/** Flying by hand. Its keys count only while the focus is in here, and the controls are engaged and shown. */
export function HandsOnPanel() {
  const root = useRef<HTMLDivElement>(null);
  const { phase } = handsOn.value;
  useLayoutEffect(() => {
    if (phase !== "entering" && phase !== "flying") return;
    if (phase === "flying" && root.current?.contains(document.activeElement)) return; // an entry, and the hands are there
    root.current?.focus(); // the button that began it is gone
    root.current?.scrollIntoView({ block: "start" });
  }, [phase]);
  useLayoutEffect(() => {
    if (engaged.value && document.activeElement === document.body) root.current?.focus(); // a button went away by itself
  });
  const vehicle = handsVehicle.value;
  if (vehicle === null) return <HandsNoVehicle />;
  const look = !engaged.value ? "" : byControls.value ? "engaged on-controls" : "engaged on-tasks";
  const name = tasksOnly.value ? `Command ${vehicle.id} by tasks` : `Fly ${vehicle.id} by hand`;
  return (
    <div class={`panel-body hands-on ${look}`} data-phase={phase} data-hands={!tasksOnly.value} role="group" aria-label={name} tabIndex={-1} ref={root} onKeyDown={onKeyDown} onFocusOut={onFocusOut}>
      <Head />
      {handsOn.value.refusal !== null && <RefusalNote refusal={handsOn.value.refusal} />}
      {steering.value && attendance.value === "warned" && <IsAnybodyThere vehicle={vehicle.id} />}
      {phase === "off" && <HandsLease vehicle={vehicle.id} />}
      {phase === "opening" && <p role="status">Asking for the lease of {vehicle.id}…</p>}
      {phase === "leased" && <HandsEntry vehicle={vehicle.id} />}
      {(phase === "entering" || phase === "leaving") && <HandsSteps />}
      {engaged.value && <WaysOut vehicle={vehicle.id} />}
      {phase === "silent" && <HandsOffNote vehicle={vehicle.id} />}
      {engaged.value && !tasksOnly.value && <HandsPages />}
      {!byControls.value && <HandsTasks vehicle={vehicle.id} />}
      <HandsReadout />
      {byControls.value && <HandsControls vehicle={vehicle.id} />}
      {tasksOnly.value && <HandsCommanded vehicle={vehicle.id} />}
      {(phase === "leased" || phase === "flying") && <HandsOffer vehicle={vehicle.id} />}
      {phase === "off" && <HandsAbilities vehicle={vehicle} />}
    </div>
  );
}

function onKeyDown(event: KeyboardEvent): void {
  if (!byControls.value || (event.target instanceof Element && event.target.closest(FIELDS) !== null)) return;
  held.value = pressed(held.value, event);
  if (flies(event.code) && !event.ctrlKey && !event.altKey && !event.metaKey) event.preventDefault(); // else the panel scrolls
}

/** Keys count only in here: none that is down goes on counting when the focus goes elsewhere, to the map too. */
function onFocusOut({ currentTarget, relatedTarget }: FocusEvent): void {
  const stays = relatedTarget instanceof Node && (currentTarget as Node).contains(relatedTarget);
  if (!stays) held.value = NONE_HELD;
}

function Head() {
  const vehicle = handsVehicle.value;
  if (vehicle === null) return null;
  const state = offboardNow.value?.state ?? "idle";
  const on = engaged.value && state === "active";
  const off = state === "idle" || handsOn.value.phase === "silent";
  return (
    <header class="hands-head">
      <h3>{tasksOnly.value ? `${vehicle.id} by tasks` : `${vehicle.id} by hand`}</h3>
      <span class={`hands-state ${on ? "on" : ""}`} role="status">
        {on ? (handsOn.value.leads === "tasks" ? "Flies tasks" : "Hands on") : off ? (tasksOnly.value ? "Not commanded" : "Hands off") : plain(state)}
      </span>
      {tasksOnly.value && engaged.value && <small class="hands-how">Commanded, not flown by hand</small>}
    </header>
  );
}

/** Before hands count as gone that have not moved for long. */
function IsAnybodyThere({ vehicle }: { vehicle: string }) {
  return (
    <div class="hands-note tone-warn" role="alert">
      <b>Is anybody there?</b>
      <p>Nothing was touched for {WARN_AFTER_MS / 1000} s. Press a key or move the mouse or a stick: after a minute nothing is sent any more, and {vehicle} holds.</p>
    </div>
  );
}

function HandsOffNote({ vehicle }: { vehicle: string }) {
  return (
    <div class="hands-note tone-warn" role="alert">
      <b>Hands off</b>
      <p>
        {handsOn.value.ended} Nothing is sent to {vehicle} any more: it stands still, then holds.
      </p>
    </div>
  );
}
