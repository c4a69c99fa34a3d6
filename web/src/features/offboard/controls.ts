/** What the controls ask for, whichever they are: each axis from -1 to 1, as seen from the vehicle. Pure. */

export interface Axes {
  readonly forward: number;
  readonly right: number;
  readonly up: number;
  readonly clockwise: number;
}

export const NEUTRAL: Axes = { forward: 0, right: 0, up: 0, clockwise: 0 };

export function isNeutral({ forward, right, up, clockwise }: Axes): boolean {
  return forward === 0 && right === 0 && up === 0 && clockwise === 0;
}

/** Several controls as one. No axis goes beyond 1, and neither does the way over ground: a corner is no faster. */
export function combineAxes(...all: readonly Axes[]): Axes {
  const sum = (axis: keyof Axes) => all.reduce((total, one) => total + one[axis], 0);
  const [forward, right] = clampToCircle(sum("forward"), sum("right"));
  return { forward, right, up: clampToUnit(sum("up")), clockwise: clampToUnit(sum("clockwise")) };
}

/** The point itself, or where the way to it leaves the circle of radius 1. What is no number counts as 0. */
function clampToCircle(x: number, y: number): [number, number] {
  const far = Math.hypot(x, y);
  if (!Number.isFinite(far)) return [0, 0];
  return far > 1 ? [x / far, y / far] : [x, y];
}

function clampToUnit(value: number): number {
  return Number.isFinite(value) ? Math.max(-1, Math.min(1, value)) : 0;
}

/** Nothing below `zone`, and from there on evenly up to 1, so that there is no jump at its edge. */
export function applyDeadZone(value: number, zone: number): number {
  const size = Math.abs(clampToUnit(value));
  return size <= zone ? 0 : (Math.sign(value) * (size - zone)) / (1 - zone);
}

// The keys that fly, by their place on the keyboard, and which of them are held. Pure.

interface Key {
  readonly axis: keyof Axes;
  readonly sign: 1 | -1;
}

const KEYS: Readonly<Record<string, Key>> = {
  KeyW: { axis: "forward", sign: 1 },
  ArrowUp: { axis: "forward", sign: 1 },
  KeyS: { axis: "forward", sign: -1 },
  ArrowDown: { axis: "forward", sign: -1 },
  KeyD: { axis: "right", sign: 1 },
  ArrowRight: { axis: "right", sign: 1 },
  KeyA: { axis: "right", sign: -1 },
  ArrowLeft: { axis: "right", sign: -1 },
  KeyR: { axis: "up", sign: 1 },
  PageUp: { axis: "up", sign: 1 },
  KeyF: { axis: "up", sign: -1 },
  PageDown: { axis: "up", sign: -1 },
  KeyE: { axis: "clockwise", sign: 1 },
  KeyQ: { axis: "clockwise", sign: -1 },
};

export type HeldKeys = ReadonlySet<string>;
export const NO_KEYS: HeldKeys = new Set();

export interface KeyPress {
  readonly code: string;
  readonly repeat: boolean;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
}

export function isFlightKey(code: string): boolean {
  return code in KEYS;
}

/**
 * After a key went down. A repeated one never begins anything: it is held from before, when its press did not count.
 * With a modifier it is the browser's or the system's, and its release may be lost: nothing is held then.
 */
export function pressKey(held: HeldKeys, { code, repeat, ctrlKey, altKey, metaKey }: KeyPress): HeldKeys {
  if (ctrlKey || altKey || metaKey) return NO_KEYS;
  return repeat || !isFlightKey(code) ? held : new Set([...held, code]);
}

export function releaseKey(held: HeldKeys, code: string): HeldKeys {
  return held.has(code) ? new Set([...held].filter((other) => other !== code)) : held;
}

/** Opposite keys together are none. */
export function keyAxes(held: HeldKeys): Axes {
  return combineAxes(...[...held].map((code) => axesOf(KEYS[code])));
}

function axesOf(key: Key | undefined): Axes {
  return key === undefined ? NEUTRAL : { ...NEUTRAL, [key.axis]: key.sign };
}

// A gamepad as two sticks: left climbs and turns, right moves (as most RC senders have them, mode 2). Pure.

export interface GamepadReading {
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
export function gamepadAxes(axes: readonly number[]): Axes {
  const [turn = 0, down = 0, right = 0, back = 0] = axes.map(
    (value) => applyDeadZone(clampToUnit(value), PAD_DEAD_ZONE) || 0,
  );
  return { forward: -back || 0, right, up: -down || 0, clockwise: turn };
}

/** `unmapped`: the meaning of its axes is unknown, so it never counts. */
export type GamepadState = "none" | "unmapped" | "uncentred" | "active";

/**
 * Lets a gamepad count only after all its sticks were once in the middle: none that lies on its side flies anything.
 */
export class GamepadGate {
  #open: string | null = null;
  state: GamepadState = "none";

  /** From the start again, for another pilot. */
  shut(): void {
    this.#open = null;
    this.state = "none";
  }

  read(pad: GamepadReading | null): Axes {
    if (pad === null || !pad.connected) {
      this.shut();
      return NEUTRAL;
    }
    if (!isStandard(pad)) {
      this.shut();
      this.state = "unmapped";
      return NEUTRAL;
    }
    const axes = gamepadAxes(pad.axes);
    if (this.#open !== pad.id) this.#open = isNeutral(axes) ? pad.id : null;
    this.state = this.#open === null ? "uncentred" : "active";
    return this.#open === null ? NEUTRAL : axes;
  }
}

/** The first connected one that can count, else the first of all. Browsers leave holes where one was unplugged. */
export function selectGamepad(pads: readonly (GamepadReading | null)[]): GamepadReading | null {
  const connected = pads.filter((pad) => pad?.connected === true);
  return connected.find((pad) => pad !== null && isStandard(pad)) ?? connected[0] ?? null;
}

function isStandard({ mapping }: GamepadReading): boolean {
  return mapping === "standard";
}

// The two sticks on the screen. Pure.

export type Side = "left" | "right";

/** Where a knob is: right and up, each from -1 to 1. */
export type Knob = readonly [x: number, y: number];
export const CENTRED: Knob = [0, 0];

/** A finger is never put down quite in the middle. */
const STICK_DEAD_ZONE = 0.08;

/** The knob under a pointer so many pixels right of the middle and below it. */
export function knobAt(right_px: number, below_px: number, radius_px: number): Knob {
  return clampToCircle(right_px / radius_px, -below_px / radius_px);
}

export function stickAxes(left: Knob, right: Knob): Axes {
  const [turn, up, sideways, forward] = [...left, ...right].map((value) => applyDeadZone(value, STICK_DEAD_ZONE)) as [
    number,
    number,
    number,
    number,
  ];
  return { forward, right: sideways, up, clockwise: turn };
}

/** Where the knobs stand for these axes, whatever control sets them. */
export function knobsOf({ forward, right, up, clockwise }: Axes): Readonly<Record<Side, Knob>> {
  return { left: clampToCircle(clockwise, up), right: clampToCircle(right, forward) };
}
