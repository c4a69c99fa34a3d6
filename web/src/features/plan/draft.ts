/** The plan being prepared: its text, what the service says about it, and sending it to a vehicle. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import { asProblem, type ProblemError } from "../../api/problem";
import type { Finding, PlanDocument, Timeline, Wind } from "../../api/types";
import { report } from "../../store/notices";
import { keepPlan, readStoredPlans } from "../../store/plans";
import { selectRun, vehicleId } from "../../store/selection";
import { dispatch, feed, live } from "../../store/store";
import { withoutNulls } from "./document";
import { draftPlan, draftText, openDraft, planText } from "./draft-text";
import { wind } from "./wind";

const CHECK_DELAY_MS = 300;

export type Check =
  | { readonly kind: "none" }
  | {
      readonly kind: "done";
      readonly findings: readonly Finding[];
      readonly timeline: Timeline | null;
      readonly parametersAgeS: number | null;
    }
  | { readonly kind: "refused"; readonly problem: ProblemError };

/** A stored plan that the text still is, so that it is not stored a second time. */
const storedAs = signal<{ readonly text: string; readonly id: string } | null>(null);
export const check = signal<Check>({ kind: "none" });
/** The text changed and the service has not answered to it yet: what is shown is about an earlier text. */
export const checking = signal(false);
export const sending = signal(false);

export const findings = computed<readonly Finding[]>(() => {
  if (check.value.kind === "done") return check.value.findings;
  return check.value.kind === "refused" ? check.value.problem.findings : [];
});
const hasErrors = computed(() => findings.value.some((finding) => finding.severity === "error"));
/** The service's prediction for the draft; while it is being checked anew, the one for what it was just before. */
export const draftTimeline = computed(() => (check.value.kind === "done" ? check.value.timeline : null));
/** Places in the document that something is wrong with. */
export const findingPointers = computed<ReadonlySet<string>>(
  () => new Set(findings.value.map(({ pointer }) => pointer)),
);
export const storedId = computed(() => (storedAs.value?.text === draftText.value ? storedAs.value.id : null));
export const isStored = computed(() => storedId.value !== null);
export const canSend = computed(
  () =>
    live.value &&
    draftPlan.value !== null &&
    check.value.kind === "done" &&
    !checking.value &&
    !hasErrors.value &&
    !sending.value,
);

/** The service stores no plan that has errors. */
export const canStore = computed(() => canSend.value && !isStored.value);

export async function openStored(id: string): Promise<void> {
  try {
    const stored = await api.plan(id);
    const text = planText(withoutNulls(stored.plan));
    keepPlan(stored);
    storedAs.value = { text, id };
    openDraft(text);
  } catch (error) {
    report(`Read plan ${id}`, error);
  }
}

/**
 * The newest event that says that the chosen vehicle's parameters were changed: what was found may be otherwise now.
 */
const parametersSeq = computed(
  () =>
    feed.value.findLast((event) => event.kind === "vehicle.parameters" && event.vehicle_id === vehicleId.value)
      ?.position ?? 0,
);

/**
 * Check the draft a moment after the last change, against the chosen vehicle in the typed wind; an older answer never
 * wins.
 */
export function watchDraft(): void {
  effect(() => {
    const [plan, vehicle, air] = [draftPlan.value, vehicleId.value, wind.value];
    void parametersSeq.value;
    if (plan === null || !live.value) {
      check.value = { kind: "none" };
      checking.value = false;
      return undefined;
    }
    const abort = new AbortController();
    checking.value = true;
    const timer = setTimeout(() => void runCheck(plan, vehicle, air, abort.signal), CHECK_DELAY_MS);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  });
}

async function runCheck(
  plan: PlanDocument,
  vehicle: string | null,
  air: Wind | null,
  signal: AbortSignal,
): Promise<void> {
  try {
    const { findings, timeline, parameters_age_s } = await api.checkPlan(plan, vehicle, air, signal);
    if (signal.aborted) return;
    check.value = { kind: "done", findings, timeline, parametersAgeS: parameters_age_s ?? null };
  } catch (error) {
    if (signal.aborted) return;
    check.value = { kind: "refused", problem: asProblem(error) };
  }
  checking.value = false;
}

/** Store the draft unless it is stored, and make a run of it: uploads to the vehicle, and starts nothing. */
export async function uploadDraft(vehicle: string): Promise<void> {
  const plan = draftPlan.value;
  const air = wind.value;
  if (plan === null || sending.value) return;
  sending.value = true;
  try {
    const run = await api.createRun(await storeDraft(plan), vehicle, false, air);
    dispatch({ type: "run_read", run });
    selectRun(run.id);
  } catch (error) {
    report(`Upload to ${vehicle}`, error);
  } finally {
    sending.value = false;
  }
}

/** Store the draft, to be flown later or by somebody else. */
export async function keepDraft(): Promise<void> {
  const plan = draftPlan.value;
  if (plan === null || sending.value) return;
  sending.value = true;
  try {
    await storeDraft(plan);
  } catch (error) {
    report("Store the plan", error);
  } finally {
    sending.value = false;
  }
}

async function storeDraft(plan: PlanDocument): Promise<string> {
  const text = draftText.value;
  if (storedAs.value?.text === text) return storedAs.value.id;
  const stored = await api.createPlan(plan);
  keepPlan(stored);
  storedAs.value = { text, id: stored.id };
  void readStoredPlans();
  return stored.id;
}
