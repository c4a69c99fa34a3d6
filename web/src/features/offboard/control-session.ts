import type { QueueRequest } from "../../api/types";
/** The one session of this page: it sends what the controls ask for, and ends as soon as they are unattended. */

import { batch, computed, effect } from "@preact/signals";
import { readToken } from "../../api/token";
import type { Point } from "../../geo/geometry";
import { panel, vehicleId } from "../../store/selection";
import {
  checkActivity,
  isPageActive,
  recordActivity,
  unattendedReason,
  watchActivity,
  watchAttention,
  watchKeys,
} from "./activity";
import { acceptsControls, maxSpeeds, sticksHeld } from "./capabilities";
import {
  controlledVehicle,
  engaged,
  goToArmed,
  goToTarget,
  heldKeys,
  inputAxes,
  manualControl,
  pollGamepads,
  resetControls,
  steering,
} from "./control-state";
import { isNeutral, NEUTRAL, NO_KEYS, releaseKey } from "./controls";
import type { Refusal } from "./refusal";
import type { StopReason } from "./sender";
import { Session } from "./session";
import { positionSetpoint, type Setpoint, velocitySetpoint, zeroSetpoint } from "./setpoint";
import { openOffboardSocket } from "./socket";

/** What all controls together ask for; nothing unless they are engaged, and the vehicle follows them. */
export const requestedAxes = computed(() =>
  engaged.value && !manualControl.value.tasksOnly ? inputAxes.value : NEUTRAL,
);

const session = new Session({
  connect: (vehicle, events) => openOffboardSocket(vehicle, readToken(), events),
  now: () => performance.now(),
  followsControls: acceptsControls,
  nextSetpoint,
  neutral: standStill,
  isPresent: isPageActive,
  onResetControls: resetControls,
  onChange: (next) => (manualControl.value = next),
});

export const acquireLease = (vehicle: string, override = false): void => session.acquireLease(vehicle, override);
export const offerLease = (to: string | null): Promise<void> => session.offerLease(to);
export function enterOffboard(): Promise<void> {
  recordActivity();
  return session.enter(sticksHeld.value);
}
export const leaveOffboard = (to: "hold" | "mission" | "return"): Promise<void> => session.leave(to);
export const releaseLease = (): void => session.releaseLease();
/** Null: it is done; else why it is not. */
export const requestQueue = (
  action: string,
  frame: QueueRequest,
  onQueued?: (task_id: string) => void,
): Promise<Refusal | null> => session.queue(action, frame, onQueued);

function vehicleType() {
  return controlledVehicle.value?.vehicle_type ?? "multicopter";
}

function standStill(): Setpoint {
  return zeroSetpoint(maxSpeeds.value, vehicleType());
}

function nextSetpoint(): Setpoint | StopReason {
  const away = unattendedReason();
  if (away !== null) return away;
  if (checkActivity(pollGamepads()) === "inactive") return "no_input";
  const axes = requestedAxes.value;
  if (!isNeutral(axes)) {
    goToTarget.value = null; // a moved control is newer than the place
    return velocitySetpoint(axes, maxSpeeds.value, vehicleType());
  }
  const place = goToTarget.value;
  return place === null ? standStill() : positionSetpoint(place.at, place.altitude_m);
}

/** A click on the map with the go-to tool: a destination at the current altitude. True if it was used. */
export function goToPoint(at: Point): boolean {
  if (!goToArmed.value) return false;
  const altitude_m = controlledVehicle.value?.state.absolute_altitude_m ?? null;
  batch(() => {
    goToArmed.value = false;
    if (manualControl.value.phase === "flying" && altitude_m !== null) goToTarget.value = { at, altitude_m };
  });
  return true;
}

/**
 * By one press, with any tool and any focus. An entry is cancelled: closing the socket commands Hold.
 */
function leaveByEscape(): void {
  const { phase } = manualControl.value;
  if (phase === "entering") session.releaseLease();
  else if (phase === "flying") void session.leave("hold");
}

const PAD_LOOK_MS = 250;

/** Looking at another panel or vehicle gives the lease back. */
export function watchManualControl(): void {
  watchActivity();
  watchKeys(window, {
    onRelease: (code) => (heldKeys.value = releaseKey(heldKeys.value, code)),
    onEscape: leaveByEscape,
  });
  watchAttention((reason) => {
    heldKeys.value = NO_KEYS; // releases outside of the page are never reported
    if (reason !== "focus_lost" || engaged.value) session.unattended(reason);
  });
  effect(() => {
    if (!engaged.value) resetControls();
  });
  effect(() => {
    const controls = !isNeutral(requestedAxes.value) || goToTarget.value !== null;
    if (controls && manualControl.value.source === "tasks" && unattendedReason() === null) session.switchToControls();
  });
  effect(() => {
    const { vehicle, phase } = manualControl.value;
    if (phase === "off" || phase === "silent") return;
    if (panel.value !== "offboard") session.releaseLease("left_panel");
    else if (vehicleId.value !== null && vehicleId.value !== vehicle) session.releaseLease("other_vehicle");
  });
  effect(() => {
    if (panel.value !== "offboard") return undefined;
    const timer = setInterval(() => !document.hidden && !steering.value && pollGamepads(), PAD_LOOK_MS);
    return () => clearInterval(timer);
  });
}
