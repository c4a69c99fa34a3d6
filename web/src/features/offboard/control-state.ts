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
  firstPad,
  type Held,
  type Knob,
  keyAxes,
  NEUTRAL,
  NONE_HELD,
  PadGate,
  type PadReading,
  type PadState,
  stickAxes,
  together,
} from "./controls";
import { CONTROL_OFF, type ManualControl } from "./session";
import type { Pace } from "./setpoint";

export const manualControl = signal<ManualControl>(CONTROL_OFF);
/** The controls count. */
export const engaged = computed(
  () => manualControl.value.phase === "entering" || manualControl.value.phase === "flying",
);

/** The controls lead: the page says all the time what they want. */
export const steering = computed(() => engaged.value && manualControl.value.leads === "controls");

/** What is chosen to fly with. */
export const controlPage = signal<"controls" | "tasks">("controls");

/** The controls are shown, and their keys count. */
export const byControls = computed(
  () => engaged.value && controlPage.value === "controls" && !manualControl.value.tasksOnly,
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
export const offboardNow = computed<Offboard | null>(
  () => manualControl.value.offboard ?? (live.value ? (controlledVehicle.value?.state.offboard ?? null) : null),
);

// What is held now: keys, sticks on the screen, a gamepad, a place on the map. Whether it counts is not judged here.

export const held = signal<Held>(NONE_HELD);
export const leftKnob = signal<Knob>(CENTRED);
export const rightKnob = signal<Knob>(CENTRED);
export const padName = signal("");
export const padState = signal<PadState>("none");
export const pace = signal<Pace>("slow");
const padAxes = signal<Axes>(NEUTRAL);

/** The go-to tool is in hand: the next click on the map is a destination. */
export const goToArmed = signal(false);
export const goTo = signal<{ readonly at: Point; readonly altitude_m: number } | null>(null);

export const heldAxes = computed(() =>
  together(keyAxes(held.value), stickAxes(leftKnob.value, rightKnob.value), padAxes.value),
);

const gate = new PadGate();

/** All let go. A gamepad that lies on its side counts again only from its middle. */
export function resetControls(): void {
  batch(() => {
    held.value = NONE_HELD;
    leftKnob.value = rightKnob.value = CENTRED;
    padAxes.value = NEUTRAL;
    goToArmed.value = false;
    goTo.value = null;
  });
  gate.shut();
}

/** Gamepads tell nothing by themselves: they are asked. Returns the one that was looked at. */
export function readPads(): PadReading | null {
  const pad = firstPad(navigator.getGamepads());
  const axes = gate.read(pad);
  batch(() => {
    padAxes.value = axes;
    padName.value = pad?.id ?? "";
    padState.value = gate.state;
  });
  return pad;
}
