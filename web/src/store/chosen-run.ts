/** The chosen run, if the page does not know it: it is read from the service, and no other is shown in its place. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../api/client";
import { type ProblemError, toProblem } from "../api/problem";
import { attention, panel, runId, vehicleId } from "./selection";
import { dispatch, live, runs } from "./store";

/** Why a run could not be read; of the chosen one, it is to be said. */
const failed = signal<{ readonly run: string; readonly problem: ProblemError } | null>(null);

/** The chosen run that is not known; null if none was chosen. */
export const unknownRun = computed(() => (runId.value !== null && !(runId.value in runs.value) ? runId.value : null));

/** Null while it is being read. */
export const unknownRunProblem = computed(() =>
  failed.value?.run === unknownRun.value ? (failed.value?.problem ?? null) : null,
);

/** With each choice and each connection: a snapshot of the stream has the open runs and the newest ones only. */
export function watchChosenRun(): void {
  effect(() => {
    if (live.value && unknownRun.value !== null) void readRun(unknownRun.value);
  });
}

export async function readRun(id: string): Promise<void> {
  failed.value = null;
  const isWatched = attention();
  try {
    const run = await api.run(id);
    dispatch({ type: "run_read", run });
    // on another panel, one that was chosen beside the run may be under manual control by now
    if (isWatched() && (vehicleId.peek() === null || panel.peek() === "run")) vehicleId.value = run.vehicle_id;
  } catch (error) {
    failed.value = { run: id, problem: toProblem(error) };
  }
}
