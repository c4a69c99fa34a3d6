/**
 * The plan of the chosen run. One that follows a moving target gets another plan every few seconds: until that is
 * read, the one before.
 */

import { computed, effect } from "@preact/signals";
import type { StoredPlan } from "../../api/types";
import { loadPlan, plansById } from "../../store/plans";
import { selectedRun } from "../../store/selection";
import { viewPlan } from "../plan/document";

let before: { readonly run: string; readonly plan: StoredPlan } | null = null;

export const runPlan = computed<StoredPlan | null>(() => {
  const run = selectedRun.value;
  if (run === null) return null;
  const plan = plansById.value[run.plan_id];
  if (plan !== undefined) before = { run: run.id, plan };
  return before?.run === run.id ? before.plan : null;
});

/** Read once: telemetry and the run's progress do not change it. */
export const runPlanView = computed(() => (runPlan.value === null ? null : viewPlan(runPlan.value.plan)));

const planId = computed(() => selectedRun.value?.plan_id ?? null);

export function watchRunPlan(): void {
  effect(() => {
    if (planId.value !== null) loadPlan(planId.value);
  });
}
