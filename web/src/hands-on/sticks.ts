/** The two sticks on the screen. Pure. */

import { within, withDeadZone, type Axes } from "./axes";

export type Side = "left" | "right";

/** Where a knob is: right and up, each from -1 to 1. */
export type Knob = readonly [x: number, y: number];
export const CENTRED: Knob = [0, 0];

/** A finger is never put down quite in the middle. */
const STICK_DEAD_ZONE = 0.08;

/** The knob under a pointer so many pixels right of the middle and below it. */
export function knobAt(right_px: number, below_px: number, radius_px: number): Knob {
  return within(right_px / radius_px, -below_px / radius_px);
}

export function stickAxes(left: Knob, right: Knob): Axes {
  const [turn, up, sideways, forward] = [...left, ...right].map((value) => withDeadZone(value, STICK_DEAD_ZONE)) as [number, number, number, number];
  return { forward, right: sideways, up, clockwise: turn };
}

/** Where the knobs stand for what is asked, whoever asks for it. */
export function knobsOf({ forward, right, up, clockwise }: Axes): Readonly<Record<Side, Knob>> {
  return { left: within(clockwise, up), right: within(right, forward) };
}
