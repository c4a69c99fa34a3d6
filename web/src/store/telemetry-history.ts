/** The last minutes of each vehicle's telemetry, once a second: for the strips beside a run. */

import { signal } from "@preact/signals";
import type { VehicleState } from "../api/types";

/** Five minutes. */
export const MAX_SAMPLES = 300;
const STEP_S = 1;
/** A longer silence is drawn as a break: what was in between is not known. */
export const BREAK_S = 5;

export interface Sample {
  readonly time: number;
  readonly relative_altitude_m: number | null;
  readonly ground_speed_m_s: number | null;
  readonly battery_percent: number | null;
}

export class TelemetryHistory {
  readonly #samples = new Map<string, readonly Sample[]>();

  /**
   * True if something was added. `time` is Unix seconds; within a second nothing is added. The service's clock may be
   * set back: the strip then begins anew.
   */
  add(states: Readonly<Record<string, VehicleState>>, time: number): boolean {
    let grown = false;
    for (const [id, state] of Object.entries(states)) {
      const kept = this.#samples.get(id) ?? [];
      const known = time < (kept.at(-1)?.time ?? 0) ? [] : kept;
      const last = known.at(-1);
      if (!state.connected || (last !== undefined && time - last.time < STEP_S)) continue;
      // a new list: components look at nothing else
      this.#samples.set(id, [...known.slice(1 - MAX_SAMPLES), sampleOf(state, time)]);
      grown = true;
    }
    return grown;
  }

  of(id: string): readonly Sample[] {
    return this.#samples.get(id) ?? [];
  }
}

export const telemetryHistory = new TelemetryHistory();
/** Counts up when the strips have grown: what reads them depends on it. */
export const telemetryVersion = signal(0);

function sampleOf(
  { relative_altitude_m, velocity_north_m_s: north, velocity_east_m_s: east, battery_percent }: VehicleState,
  time: number,
): Sample {
  return {
    time,
    relative_altitude_m,
    ground_speed_m_s: north === null || east === null ? null : Math.hypot(north, east),
    battery_percent,
  };
}

/**
 * One quantity as an SVG path in a box of `width` by `height`, over the time that is kept; and its range. Null without
 * two values.
 */
export function stripPath(
  samples: readonly Sample[],
  value: (sample: Sample) => number | null,
  width: number,
  height: number,
  least_range: number,
): { readonly path: string; readonly low: number; readonly high: number } | null {
  const known = samples.flatMap((sample) => {
    const y = value(sample);
    return y === null ? [] : [{ time: sample.time, y }];
  });
  const first = known[0];
  if (first === undefined || known.length < 2) return null;
  const low = Math.min(...known.map(({ y }) => y));
  const high = Math.max(...known.map(({ y }) => y), low + least_range);
  const span_s = Math.max(60, (known.at(-1)?.time ?? 0) - first.time);
  let before = -Infinity;
  const path = known.map(({ time, y }) => {
    const step = time - before > BREAK_S ? "M" : "L";
    before = time;
    const [right, up] = [(time - first.time) / span_s, (y - low) / (high - low)];
    return `${step}${(right * width).toFixed(1)} ${((1 - up) * height).toFixed(1)}`;
  });
  return { path: path.join(""), low, high };
}
