/** The plan being prepared: its text, what the service says about it, and sending it to a vehicle. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../api/client";
import { asProblem, type ProblemError } from "../api/problem";
import type { Finding, PlanDocument, Timeline } from "../api/types";
import { parsePlanText, viewPlan } from "../plan/document";
import { keepPlan } from "./plans";
import { report } from "./notices";
import { selectRun, vehicleId } from "./selection";
import { dispatch, live } from "./store";

const KEY = "waydrop.draft";
const CHECK_DELAY_MS = 300;

export type Check =
  | { readonly kind: "none" }
  | { readonly kind: "done"; readonly findings: readonly Finding[]; readonly timeline: Timeline | null }
  | { readonly kind: "refused"; readonly problem: ProblemError };

export const draftText = signal(sessionStorage.getItem(KEY) ?? "");
/** A stored plan that the text still is, so that it is not stored a second time. */
const storedAs = signal<{ readonly text: string; readonly id: string } | null>(null);
export const check = signal<Check>({ kind: "none" });
/** The text changed and the service has not answered to it yet: what is shown is about an earlier text. */
export const checking = signal(false);
export const sending = signal(false);

export const parsed = computed(() => parsePlanText(draftText.value));
export const draftPlan = computed<PlanDocument | null>(() => (parsed.value !== null && "plan" in parsed.value ? parsed.value.plan : null));
export const draftView = computed(() => (draftPlan.value === null ? null : viewPlan(draftPlan.value)));
export const findings = computed<readonly Finding[]>(() => {
  if (check.value.kind === "done") return check.value.findings;
  return check.value.kind === "refused" ? check.value.problem.findings : [];
});
export const hasErrors = computed(() => findings.value.some((finding) => finding.severity === "error"));
export const canSend = computed(
  () => live.value && draftPlan.value !== null && check.value.kind === "done" && !checking.value && !hasErrors.value && !sending.value,
);

export function editDraft(text: string): void {
  draftText.value = text;
}

export async function openStored(id: string): Promise<void> {
  try {
    const stored = await api.plan(id);
    const text = JSON.stringify(stored.plan, null, 2);
    keepPlan(stored);
    storedAs.value = { text, id };
    draftText.value = text;
  } catch (error) {
    report(`Read plan ${id}`, error);
  }
}

/** Check the draft a moment after the last change, against the chosen vehicle; an older answer never wins. */
export function watchDraft(): void {
  effect(() => {
    sessionStorage.setItem(KEY, draftText.value);
  });
  effect(() => {
    const [plan, vehicle] = [draftPlan.value, vehicleId.value];
    if (plan === null || !live.value) {
      check.value = { kind: "none" };
      checking.value = false;
      return undefined;
    }
    const abort = new AbortController();
    checking.value = true;
    const timer = setTimeout(() => void runCheck(plan, vehicle, abort.signal), CHECK_DELAY_MS);
    return () => {
      clearTimeout(timer);
      abort.abort();
    };
  });
}

async function runCheck(plan: PlanDocument, vehicle: string | null, signal: AbortSignal): Promise<void> {
  try {
    const { findings, timeline } = await api.checkPlan(plan, vehicle, signal);
    if (signal.aborted) return;
    check.value = { kind: "done", findings, timeline };
  } catch (error) {
    if (signal.aborted) return;
    check.value = { kind: "refused", problem: asProblem(error) };
  }
  checking.value = false;
}

/** Store the draft unless it is stored, and make a run of it: uploads to the vehicle, and starts nothing. */
export async function uploadDraft(vehicle: string): Promise<void> {
  const plan = draftPlan.value;
  if (plan === null || sending.value) return;
  sending.value = true;
  try {
    const run = await api.createRun(await storeDraft(plan), vehicle, false);
    dispatch({ type: "run_read", run });
    selectRun(run.id);
  } catch (error) {
    report(`Upload to ${vehicle}`, error);
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
  return stored.id;
}
