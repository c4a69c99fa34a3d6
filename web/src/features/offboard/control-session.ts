/** The one session of this page: what the controls ask for goes in, and losing somebody's attention ends it at once. */

import { batch, computed, effect } from "@preact/signals";
import { readToken } from "../../api/token";
import type { Point } from "../../geo/geometry";
import { panel, vehicleId } from "../../store/selection";
import { attendanceNow, isPresent, touched, watchAttention, watchInput, watchKeys, whyUnattended } from "./attendance";
import { followsControls, speeds, sticksHeld } from "./capabilities";
import {
  controlledVehicle,
  engaged,
  goTo,
  goToArmed,
  held,
  heldAxes,
  manualControl,
  readPads,
  resetControls,
  steering,
} from "./control-state";
import { isNeutral, NEUTRAL, NONE_HELD, released } from "./controls";
import type { Refusal } from "./refusal";
import type { StopReason } from "./sender";
import { Session } from "./session";
import { neutral, placeOf, type Setpoint, velocityOf } from "./setpoint";
import { openWire, type QueueAsk } from "./socket";

/** What all controls together ask for; nothing unless they are engaged, and the vehicle follows them. */
export const asked = computed(() => (engaged.value && !manualControl.value.tasksOnly ? heldAxes.value : NEUTRAL));

const session = new Session({
  connect: (vehicle, events) => openWire(vehicle, readToken(), events),
  now: () => performance.now(),
  followsControls,
  ask,
  neutral: standStill,
  isPresent,
  onResetControls: resetControls,
  onChange: (next) => (manualControl.value = next),
});

export const takeLease = (vehicle: string, override = false): void => session.take(vehicle, override);
export const handOver = (to: string | null): Promise<void> => session.handOver(to);
export function enter(): Promise<void> {
  touched();
  return session.enter(sticksHeld.value);
}
export const leave = (to: "hold" | "mission" | "return"): Promise<void> => session.leave(to);
export const giveBack = (): void => session.giveBack();
/** Null: it is done; else why it is not. */
export const askQueue = (
  doing: string,
  frame: QueueAsk,
  onQueued?: (task_id: string) => void,
): Promise<Refusal | null> => session.queue(doing, frame, onQueued);

function vehicleType() {
  return controlledVehicle.value?.vehicle_type ?? "multicopter";
}

function standStill(): Setpoint {
  return neutral(speeds.value, vehicleType());
}

function ask(): Setpoint | StopReason {
  const away = whyUnattended();
  if (away !== null) return away;
  if (attendanceNow(readPads()) === "nobody") return "nobody";
  const axes = asked.value;
  if (!isNeutral(axes)) {
    goTo.value = null; // a moved control is newer than the place
    return velocityOf(axes, speeds.value, vehicleType());
  }
  const place = goTo.value;
  return place === null ? standStill() : placeOf(place.at, place.altitude_m);
}

/** A click on the map with the go-to tool in hand: one destination, at the altitude of now. True if it was meant. */
export function goThere(at: Point): boolean {
  if (!goToArmed.value) return false;
  const altitude_m = controlledVehicle.value?.state.absolute_altitude_m ?? null;
  batch(() => {
    goToArmed.value = false;
    if (manualControl.value.phase === "flying" && altitude_m !== null) goTo.value = { at, altitude_m };
  });
  return true;
}

/**
 * By one press, whatever tool is in hand and wherever the focus is. An entry is broken off: the socket's end is Hold.
 */
function leaveByEscape(): void {
  const { phase } = manualControl.value;
  if (phase === "entering") session.giveBack();
  else if (phase === "flying") void session.leave("hold");
}

const PAD_LOOK_MS = 250;

/** Looking at another panel or vehicle gives the lease back. */
export function watchManualControl(): void {
  watchInput();
  watchKeys(window, { onRelease: (code) => (held.value = released(held.value, code)), onEscape: leaveByEscape });
  watchAttention((reason) => {
    held.value = NONE_HELD; // a release outside of the page is never told
    if (reason !== "focus_left" || engaged.value) session.unattended(reason);
  });
  effect(() => {
    if (!engaged.value) resetControls();
  });
  effect(() => {
    const controls = !isNeutral(asked.value) || goTo.value !== null;
    if (controls && manualControl.value.leads === "tasks" && whyUnattended() === null) session.takeOver();
  });
  effect(() => {
    const { vehicle, phase } = manualControl.value;
    if (phase === "off" || phase === "silent") return;
    if (panel.value !== "offboard") session.giveBack("left_view");
    else if (vehicleId.value !== null && vehicleId.value !== vehicle) session.giveBack("other_vehicle");
  });
  effect(() => {
    if (panel.value !== "offboard") return undefined;
    const timer = setInterval(() => !document.hidden && !steering.value && readPads(), PAD_LOOK_MS);
    return () => clearInterval(timer);
  });
}
