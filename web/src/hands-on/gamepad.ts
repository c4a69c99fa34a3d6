/** A gamepad as two sticks: left climbs and turns, right moves (as most RC senders have them, mode 2). Pure. */

import { bounded, isNeutral, NEUTRAL, withDeadZone, type Axes } from "./axes";

export interface PadReading {
  readonly id: string;
  readonly connected: boolean;
  /** "standard" where the browser knows which axis is which; else an axis may be a trigger that rests at -1. */
  readonly mapping: string;
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly pressed: boolean }[];
}

/** Worn sticks rest up to so far from their middle. */
const PAD_DEAD_ZONE = 0.15;

/** Forward and up are negative on a gamepad. */
export function padAxes(axes: readonly number[]): Axes {
  const [turn = 0, down = 0, right = 0, back = 0] = axes.map((value) => withDeadZone(bounded(value), PAD_DEAD_ZONE) || 0);
  return { forward: -back || 0, right, up: -down || 0, clockwise: turn };
}

/** `unknown`: nobody knows what its axes mean, so it never counts. */
export type PadState = "none" | "unknown" | "waits" | "counts";

/** Lets a gamepad count only after all its sticks were once in the middle: none that lies on its side flies anything. */
export class PadGate {
  #open: string | null = null;
  state: PadState = "none";

  /** From the start again, for another pilot. */
  shut(): void {
    this.#open = null;
    this.state = "none";
  }

  read(pad: PadReading | null): Axes {
    if (pad === null || !pad.connected) {
      this.shut();
      return NEUTRAL;
    }
    if (!isStandard(pad)) {
      this.shut();
      this.state = "unknown";
      return NEUTRAL;
    }
    const axes = padAxes(pad.axes);
    if (this.#open !== pad.id) this.#open = isNeutral(axes) ? pad.id : null;
    this.state = this.#open === null ? "waits" : "counts";
    return this.#open === null ? NEUTRAL : axes;
  }
}

/** The first connected one that can count, else the first of all. Browsers leave holes where one was unplugged. */
export function firstPad(pads: readonly (PadReading | null)[]): PadReading | null {
  const connected = pads.filter((pad) => pad?.connected === true);
  return connected.find((pad) => pad !== null && isStandard(pad)) ?? connected[0] ?? null;
}

function isStandard({ mapping }: PadReading): boolean {
  return mapping === "standard";
}
