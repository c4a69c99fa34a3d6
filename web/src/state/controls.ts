/** What is held now: keys, sticks on the screen, a gamepad, a place on the map. Whether it counts is not judged here. */

import { batch, computed, signal } from "@preact/signals";
import { NEUTRAL, together, type Axes } from "../hands-on/axes";
import { firstPad, PadGate, type PadReading, type PadState } from "../hands-on/gamepad";
import { keyAxes, NONE_HELD, type Held } from "../hands-on/keys";
import type { Pace } from "../hands-on/setpoint";
import { CENTRED, stickAxes, type Knob } from "../hands-on/sticks";
import type { Point } from "../map/geometry";

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

export const heldAxes = computed(() => together(keyAxes(held.value), stickAxes(leftKnob.value, rightKnob.value), padAxes.value));

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
