/** The track tails drawn behind vehicles: bounded, thinned by distance, broken where the link was silent. Pure. */

import type { VehicleState } from "../api/types";
import { metresBetween, type Point } from "../geo/geometry";

const POINTS_PER_VEHICLE = 600;
/** Of all tracks together: a large fleet has shorter and coarser tails, and the map stays as fast. */
const POINTS_IN_ALL = 12_000;
const FINEST_STEP_M = 1;
const COARSEST_STEP_M = 5;
/** A silence in which less was flown is no break. */
const BREAK_M = 10;
/** A longer silence is drawn as a break: where the vehicle was in between is not known. */
const BREAK_S = 5;

interface TrackPoint {
  readonly at: Point;
  readonly time: number;
  /** First point after a silence. */
  readonly breaks: boolean;
}

export type Tracks = Readonly<Record<string, readonly TrackPoint[]>>;

/** Tracks with the newest positions added. `time` is Unix seconds. */
export function extendTracks(tracks: Tracks, states: Readonly<Record<string, VehicleState>>, time: number): Tracks {
  const longest = Math.min(POINTS_PER_VEHICLE, Math.floor(POINTS_IN_ALL / Math.max(1, Object.keys(tracks).length)));
  const step_m = Math.min(COARSEST_STEP_M, (FINEST_STEP_M * POINTS_PER_VEHICLE) / longest);
  let next: Record<string, readonly TrackPoint[]> | null = null;
  for (const [id, state] of Object.entries(states)) {
    const track = extendTrack(tracks[id] ?? [], state, time, longest, step_m);
    if (track === null) continue;
    next ??= { ...tracks };
    next[id] = track;
  }
  return next ?? tracks;
}

function extendTrack(
  track: readonly TrackPoint[],
  state: VehicleState,
  time: number,
  longest: number,
  step_m: number,
): readonly TrackPoint[] | null {
  const { latitude_deg, longitude_deg, position_age_s } = state;
  if (latitude_deg === null || longitude_deg === null || (position_age_s ?? 0) > BREAK_S) return null;
  const at: Point = [longitude_deg, latitude_deg];
  const last = track.at(-1);
  if (last && metresBetween(last.at, at) < step_m) return null;
  const breaks = last !== undefined && time - last.time > BREAK_S && metresBetween(last.at, at) > BREAK_M;
  return [...track.slice(1 - longest), { at, time, breaks }];
}

/** A track as lines, split at its breaks. */
export function trackLines(track: readonly TrackPoint[]): Point[][] {
  const lines: Point[][] = [];
  for (const point of track) {
    if (point.breaks || lines.length === 0) lines.push([]);
    lines.at(-1)?.push(point.at);
  }
  return lines.filter((line) => line.length > 1);
}
