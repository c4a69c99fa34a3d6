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
export function together(...all: readonly Axes[]): Axes {
  const sum = (axis: keyof Axes) => all.reduce((total, one) => total + one[axis], 0);
  const [forward, right] = within(sum("forward"), sum("right"));
  return { forward, right, up: bounded(sum("up")), clockwise: bounded(sum("clockwise")) };
}

/** The point itself, or where the way to it leaves the circle of radius 1. What is no number counts as 0. */
export function within(x: number, y: number): [number, number] {
  const far = Math.hypot(x, y);
  if (!Number.isFinite(far)) return [0, 0];
  return far > 1 ? [x / far, y / far] : [x, y];
}

export function bounded(value: number): number {
  return Number.isFinite(value) ? Math.max(-1, Math.min(1, value)) : 0;
}

/** Nothing below `zone`, and from there on evenly up to 1, so that there is no jump at its edge. */
export function withDeadZone(value: number, zone: number): number {
  const size = Math.abs(bounded(value));
  return size <= zone ? 0 : (Math.sign(value) * (size - zone)) / (1 - zone);
}
