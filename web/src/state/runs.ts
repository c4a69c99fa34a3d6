/** What can be said and done in each state of a run. Pure. */

import type { Run, RunState, Vehicle } from "../api/types";

const OVER: ReadonlySet<RunState> = new Set(["completed", "aborted", "failed", "lost"]);

export type RunAction = "start" | "pause" | "resume" | "return" | "rally" | "land" | "abort";

/** What an operator may ask for. The service decides; this only keeps useless buttons away. */
const ALLOWED: Readonly<Record<RunState, readonly RunAction[]>> = {
  created: ["abort"],
  uploading: ["abort"],
  uploaded: ["start", "abort"],
  starting: ["abort"],
  flying: ["pause", "return", "rally", "land"],
  at_drop: ["pause", "return", "rally", "land"],
  paused: ["resume", "return", "rally", "land"],
  returning: ["land"],
  landed: [],
  completed: [],
  aborted: [],
  failed: [],
  lost: [],
};

export function isOver(run: Run): boolean {
  return OVER.has(run.state);
}

/** To a rally point only where the plan has some. */
export function allowedActions(run: Run, rallyPoints = 0): readonly RunAction[] {
  const allowed = ALLOWED[run.state] ?? [];
  return rallyPoints > 0 ? allowed : allowed.filter((action) => action !== "rally");
}

/** Newest first. */
export function newestRuns(runs: Readonly<Record<string, Run>>): Run[] {
  return Object.values(runs).sort((a, b) => b.created_at - a.created_at || b.id.localeCompare(a.id));
}

/** The run that a vehicle flies now: what the service says, else the newest of its open runs. */
export function currentRun(vehicle: Vehicle, runs: Readonly<Record<string, Run>>): Run | null {
  const named = vehicle.run_id === null ? undefined : runs[vehicle.run_id];
  if (named && !isOver(named)) return named;
  return newestOpen(runs).get(vehicle.id) ?? null;
}

const known = new WeakMap<Readonly<Record<string, Run>>, ReadonlyMap<string, Run>>();

/** By vehicle. Worked out once for each state of the runs: a large fleet asks for it with every frame of telemetry. */
function newestOpen(runs: Readonly<Record<string, Run>>): ReadonlyMap<string, Run> {
  const found = known.get(runs) ?? new Map(newestRuns(runs).filter((run) => !isOver(run)).reverse().map((run) => [run.vehicle_id, run]));
  known.set(runs, found);
  return found;
}
