/** Which vehicle this page controls, and how far that is. */

import { batch, computed, signal } from "@preact/signals";
import type { Offboard, Run, Vehicle } from "../../api/types";
import type { Point } from "../../geo/geometry";
import { currentRun } from "../../store/runs";
import { selectedVehicle } from "../../store/selection";
import { live, runs, vehicles } from "../../store/store";
import {
  type Axes,
  CENTRED,
  combineAxes,
  GamepadGate,
  type GamepadReading,
  type GamepadState,
  type HeldKeys,
  type Knob,
  keyAxes,
  NEUTRAL,
  NO_KEYS,
  selectGamepad,
  stickAxes,
} from "./controls";
import { type ManualControl, NO_CONTROL } from "./session";
import type { SpeedPreset } from "./setpoint";

export const manualControl = signal<ManualControl>(NO_CONTROL);
/** The controls count. */
export const engaged = computed(
  () => manualControl.value.phase === "entering" || manualControl.value.phase === "flying",
);

/** The controls lead: the page says all the time what they want. */
export const steering = computed(() => engaged.value && manualControl.value.source === "controls");

/** What is chosen to fly with. */
export const controlTab = signal<"controls" | "tasks">("controls");

/** The controls are shown, and their keys count. */
export const controlsShown = computed(
  () => engaged.value && controlTab.value === "controls" && !manualControl.value.tasksOnly,
);

/** The vehicle that the panel is about: the one that is flown, else the chosen one. */
export const controlledVehicle = computed<Vehicle | null>(() => {
  const flown = manualControl.value.vehicle;
  return manualControl.value.phase === "off" || flown === null
    ? selectedVehicle.value
    : (vehicles.value[flown] ?? null);
});

/** The open run of that vehicle. */
export const controlledRun = computed<Run | null>(() =>
  controlledVehicle.value === null ? null : currentRun(controlledVehicle.value, runs.value),
);

/** From the own socket while there is one, else from the stream, as everybody sees it; null without either. */
export const offboardState = computed<Offboard | null>(
  () => manualControl.value.offboard ?? (live.value ? (controlledVehicle.value?.state.offboard ?? null) : null),
);

// What is held now: keys, sticks on the screen, a gamepad, a place on the map. Whether it counts is not judged here.

export const heldKeys = signal<HeldKeys>(NO_KEYS);
export const leftKnob = signal<Knob>(CENTRED);
export const rightKnob = signal<Knob>(CENTRED);
export const gamepadName = signal("");
export const gamepadState = signal<GamepadState>("none");
export const speedPreset = signal<SpeedPreset>("slow");
const padAxes = signal<Axes>(NEUTRAL);

/** The go-to tool is active: the next click on the map is a destination. */
export const goToArmed = signal(false);
export const goToTarget = signal<{ readonly at: Point; readonly altitude_m: number } | null>(null);

export const inputAxes = computed(() =>
  combineAxes(keyAxes(heldKeys.value), stickAxes(leftKnob.value, rightKnob.value), padAxes.value),
);

const gate = new GamepadGate();

/** All let go. A gamepad that lies on its side counts again only from its middle. */
export function resetControls(): void {
  batch(() => {
    heldKeys.value = NO_KEYS;
    leftKnob.value = rightKnob.value = CENTRED;
    padAxes.value = NEUTRAL;
    goToArmed.value = false;
    goToTarget.value = null;
  });
  gate.shut();
}

/** Gamepads tell nothing by themselves: they are asked. Returns the one that was looked at. */
export function pollGamepads(): GamepadReading | null {
  const pad = selectGamepad(navigator.getGamepads());
  const axes = gate.read(pad);
  batch(() => {
    padAxes.value = axes;
    gamepadName.value = pad?.id ?? "";
    gamepadState.value = gate.state;
  });
  return pad;
}
