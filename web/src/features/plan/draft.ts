/** The plan being prepared: its text, what the service says about it, and sending it to a vehicle. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import { type ProblemError, toProblem } from "../../api/problem";
import type { Finding, Job, JobRequest, PlanDocument, Timeline, Wind } from "../../api/types";
import { serviceNow } from "../../store/clock";
import { include } from "../../store/common-start";
import { commandVehicle, reportProblem } from "../../store/notices";
import { cachePlan, loadStoredPlans } from "../../store/plans";
import { attention, selectRun, vehicleId } from "../../store/selection";
import { dispatch, feed, live, world } from "../../store/store";
import { omitNulls } from "./document";
import { draftPlan, draftText, markDraftSaved, openDraft, planText } from "./draft-text";
import { wind } from "./wind";

const CHECK_DELAY_MS = 300;

type PlanCheckState =
  | { readonly kind: "none" }
  | {
      readonly kind: "done";
      readonly findings: readonly Finding[];
      readonly timeline: Timeline | null;
      /** When the vehicle's parameters were read that it was checked against, in Unix seconds. */
      readonly parametersReadAt: number | null;
    }
  | { readonly kind: "refused"; readonly problem: ProblemError };

/** A stored plan that the text still is, so that it is not stored a second time. */
const storedAs = signal<{ readonly text: string; readonly id: string } | null>(null);
export const planCheck = signal<PlanCheckState>({ kind: "none" });
/** The text changed and the service has not answered to it yet: what is shown is about an earlier text. */
export const checkingPlan = signal(false);
export const sendingPlan = signal(false);
/** The run that this page made last. */
export const uploadedRun = signal<string | null>(null);

export const findings = computed<readonly Finding[]>(() => {
  if (planCheck.value.kind === "done") return planCheck.value.findings;
  return planCheck.value.kind === "refused" ? planCheck.value.problem.findings : [];
});
const hasErrors = computed(() => findings.value.some((finding) => finding.severity === "error"));
/** The service's prediction for the draft; while it is being checked anew, the one for what it was just before. */
export const draftTimeline = computed(() => (planCheck.value.kind === "done" ? planCheck.value.timeline : null));
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
    planCheck.value.kind === "done" &&
    !checkingPlan.value &&
    !hasErrors.value &&
    !sendingPlan.value,
);

/** The service stores no plan that has errors. */
export const canStore = computed(() => canSend.value && !isStored.value);

export async function openStored(id: string): Promise<void> {
  try {
    const stored = await api.plan(id);
    const text = planText(omitNulls(stored.plan));
    cachePlan(stored);
    storedAs.value = { text, id };
    openDraft(text);
  } catch (error) {
    reportProblem(`Open plan ${id}`, error);
  }
}

/**
 * The newest event that says that the chosen vehicle's parameters were changed: what was found may be otherwise now.
 */
const parametersPosition = computed(
  () =>
    feed.value.find((event) => event.kind === "vehicle.parameters" && event.vehicle_id === vehicleId.value)?.position ??
    0,
);

/**
 * Check the draft a moment after the last change, against the chosen vehicle in the typed wind; an older answer never
 * wins.
 */
export function watchDraft(): void {
  effect(() => {
    const [plan, vehicle, air] = [draftPlan.value, vehicleId.value, wind.value];
    void parametersPosition.value;
    if (plan === null || !live.value) {
      planCheck.value = { kind: "none" };
      checkingPlan.value = false;
      return undefined;
    }
    const abort = new AbortController();
    checkingPlan.value = true;
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
    planCheck.value = { kind: "done", findings, timeline, parametersReadAt: before(parameters_age_s ?? null) };
  } catch (error) {
    if (signal.aborted) return;
    planCheck.value = { kind: "refused", problem: toProblem(error) };
  }
  checkingPlan.value = false;
}

/** The service's time so many seconds ago: an age would be no longer true a moment later. */
function before(age_s: number | null): number | null {
  const now_s = serviceNow(world.peek().serviceAhead_s);
  return age_s === null || now_s === null ? null : now_s - age_s;
}

/** Store the draft unless it is stored, and make a run of it: uploads to the vehicle, and starts nothing. */
export async function uploadDraft(vehicle: string): Promise<void> {
  const plan = draftPlan.value;
  const air = wind.value;
  if (plan === null || sendingPlan.value) return;
  const isWatched = attention();
  sendingPlan.value = true;
  await commandVehicle(`Upload to ${vehicle}`, vehicle, async () => {
    const run = await api.createRun(await ensureStored(plan), vehicle, false, air);
    dispatch({ type: "run_read", run });
    uploadedRun.value = run.id;
    include(run.id, true);
    if (isWatched()) selectRun(run.id);
  });
  sendingPlan.value = false;
}

/** Order a job of the draft, stored first unless it is, in the typed wind. Null if it was refused, which is told. */
export async function queueDraft(fields: Omit<JobRequest, "plan" | "wind">): Promise<Job | null> {
  const plan = draftPlan.value;
  const air = wind.value;
  if (plan === null || sendingPlan.value) return null;
  sendingPlan.value = true;
  try {
    return await api.createJob({ ...fields, plan: await ensureStored(plan), wind: air });
  } catch (error) {
    reportProblem("Queue the plan as a job", error);
    return null;
  } finally {
    sendingPlan.value = false;
  }
}

/** Store the draft, to fly it later or elsewhere. */
export async function storeDraft(): Promise<void> {
  const plan = draftPlan.value;
  if (plan === null || sendingPlan.value) return;
  sendingPlan.value = true;
  try {
    await ensureStored(plan);
  } catch (error) {
    reportProblem("Store the plan", error);
  } finally {
    sendingPlan.value = false;
  }
}

async function ensureStored(plan: PlanDocument): Promise<string> {
  const text = draftText.value;
  if (storedAs.value?.text === text) return storedAs.value.id;
  const stored = await api.createPlan(plan);
  cachePlan(stored);
  storedAs.value = { text, id: stored.id };
  markDraftSaved(text);
  void loadStoredPlans();
  return stored.id;
}
