/** A gamepad as two sticks: left climbs and turns, right moves (as most RC senders have them, mode 2). Pure. */

import { bounded, isNeutral, NEUTRAL, withDeadZone, type Axes } from "./axes";

export interface PadReading {
  readonly id: string;
  readonly connected: boolean;
  readonly axes: readonly number[];
}

/** Worn sticks rest up to so far from their middle. */
export const PAD_DEAD_ZONE = 0.15;

/** Forward and up are negative on a gamepad. */
export function padAxes(axes: readonly number[]): Axes {
  const [turn = 0, down = 0, right = 0, back = 0] = axes.map((value) => withDeadZone(bounded(value), PAD_DEAD_ZONE) || 0);
  return { forward: -back || 0, right, up: -down || 0, clockwise: turn };
}

export type PadState = "none" | "waits" | "counts";

/** Lets a gamepad count only after all its sticks were once in the middle: none that lies on its side flies anything. */
export class PadGate {
  #open: string | null = null;
  state: PadState = "none";

  /** From the start again, for another pair of hands. */
  shut(): void {
    this.#open = null;
    this.state = "none";
  }

  read(pad: PadReading | null): Axes {
    if (pad === null || !pad.connected) {
      this.shut();
      return NEUTRAL;
    }
    const axes = padAxes(pad.axes);
    if (this.#open !== pad.id) this.#open = isNeutral(axes) ? pad.id : null;
    this.state = this.#open === null ? "waits" : "counts";
    return this.#open === null ? NEUTRAL : axes;
  }
}

/** The first that is connected. Browsers leave holes where one was unplugged. */
export function firstPad(pads: readonly (PadReading | null)[]): PadReading | null {
  return pads.find((pad) => pad?.connected === true) ?? null;
}
