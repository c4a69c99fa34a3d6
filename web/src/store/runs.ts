/** Runs by their state and age. Pure. */

import type { Run, RunState, Vehicle } from "../api/types";

const OVER: ReadonlySet<RunState> = new Set(["completed", "aborted", "failed", "lost"]);

export function hasRunEnded(run: Pick<Run, "state">): boolean {
  return OVER.has(run.state);
}

/**
 * Seconds from the start to the end, or to the service's time (Unix seconds, null if it is not known) while the run has
 * not ended; null before the start.
 */
export function flightDuration(
  { started_at, ended_at, updated_at }: Pick<Run, "started_at" | "ended_at" | "updated_at">,
  now_s: number | null,
): number | null {
  return started_at === null ? null : Math.max(0, (ended_at ?? now_s ?? updated_at) - started_at);
}

/** Newest first. */
export function newestRuns(runs: Readonly<Record<string, Run>>): Run[] {
  return Object.values(runs).sort((a, b) => b.created_at - a.created_at || b.id.localeCompare(a.id));
}

/** The run that a vehicle flies now: what the service says, else the newest of its open runs. */
export function currentRun(vehicle: Pick<Vehicle, "id" | "run_id">, runs: Readonly<Record<string, Run>>): Run | null {
  const named = vehicle.run_id === null ? undefined : runs[vehicle.run_id];
  if (named && !hasRunEnded(named)) return named;
  return newestOpen(runs).get(vehicle.id) ?? null;
}

/** The run to show of a vehicle: the open one, else its newest. */
export function shownRun(vehicle: Pick<Vehicle, "id" | "run_id">, runs: Readonly<Record<string, Run>>): Run | null {
  return currentRun(vehicle, runs) ?? newestRuns(runs).find((run) => run.vehicle_id === vehicle.id) ?? null;
}

const known = new WeakMap<Readonly<Record<string, Run>>, ReadonlyMap<string, Run>>();

/** By vehicle. Worked out once for each state of the runs: a large fleet asks for it with every frame of telemetry. */
function newestOpen(runs: Readonly<Record<string, Run>>): ReadonlyMap<string, Run> {
  const found =
    known.get(runs) ??
    new Map(
      newestRuns(runs)
        .filter((run) => !hasRunEnded(run))
        .reverse()
        .map((run) => [run.vehicle_id, run]),
    );
  known.set(runs, found);
  return found;
}
