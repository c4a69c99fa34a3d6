/** The keys that fly, by their place on the keyboard, and which of them are held. Pure. */

import { NEUTRAL, together, type Axes } from "./axes";

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

export type Held = ReadonlySet<string>;
export const NONE_HELD: Held = new Set();

export interface KeyPress {
  readonly code: string;
  readonly repeat: boolean;
  readonly ctrlKey: boolean;
  readonly altKey: boolean;
  readonly metaKey: boolean;
}

export function flies(code: string): boolean {
  return code in KEYS;
}

/**
 * After a key went down. A repeated one never begins anything: it is held from before, when its press did not count.
 * With a modifier it is the browser's or the system's, and a release might never be told: nothing is held then.
 */
export function pressed(held: Held, { code, repeat, ctrlKey, altKey, metaKey }: KeyPress): Held {
  if (ctrlKey || altKey || metaKey) return NONE_HELD;
  return repeat || !flies(code) ? held : new Set([...held, code]);
}

export function released(held: Held, code: string): Held {
  return held.has(code) ? new Set([...held].filter((other) => other !== code)) : held;
}

/** Opposite keys together are none. */
export function keyAxes(held: Held): Axes {
  return together(...[...held].map((code) => axesOf(KEYS[code])));
}

function axesOf(key: Key | undefined): Axes {
  return key === undefined ? NEUTRAL : { ...NEUTRAL, [key.axis]: key.sign };
}
