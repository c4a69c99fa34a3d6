/** The runs that are open, and which of those that are ready the operator starts together. */

import { computed, signal } from "@preact/signals";
import { hasRunEnded, newestRuns } from "./runs";
import { selectedRun } from "./selection";
import { runs } from "./store";

/** The oldest first: a run keeps its place while others come and go. */
const openRuns = computed(() =>
  newestRuns(runs.value)
    .filter((run) => !hasRunEnded(run))
    .reverse(),
);
/** All of them, if the panel does not show the only one. */
export const listedRuns = computed(() =>
  openRuns.value.some(({ id }) => id !== selectedRun.value?.id) ? openRuns.value : [],
);
const readyRuns = computed(() => openRuns.value.filter(({ state }) => state === "uploaded"));

/** Several runs can be started together: that is the next thing to do. */
export const canStartTogether = computed(() => readyRuns.value.length > 1);

/**
 * By run, whether the common start includes it: what was uploaded from this page, and what the operator checks. One
 * that was prepared elsewhere is not included by itself. It stays so while the operator looks at something else.
 */
const included = signal<Readonly<Record<string, boolean>>>({});
export const commonStart = computed(() => readyRuns.value.filter(({ id }) => included.value[id]));

export function include(run: string, isIncluded: boolean): void {
  included.value = { ...included.value, [run]: isIncluded };
}
