/** The text of the plan being prepared, with undo and redo. Whoever edits it, in the list, on the map or as JSON, writes here. */

import { computed, effect, signal } from "@preact/signals";
import type { PlanDocument } from "../api/types";
import { parsePlanText, viewPlan } from "../plan/document";
import { reduceHistory, startHistory } from "../plan/history";

const KEY = "waydrop.draft";

const history = signal(startHistory(sessionStorage.getItem(KEY) ?? ""));
/** Counts the plans that were opened: the map looks at each of them once. */
export const draftNumber = signal(1);

export const draftText = computed(() => history.value.text);
export const canUndo = computed(() => history.value.past.length > 0);
export const canRedo = computed(() => history.value.future.length > 0);

export const parsed = computed(() => parsePlanText(draftText.value));
export const draftPlan = computed<PlanDocument | null>(() => (parsed.value !== null && "plan" in parsed.value ? parsed.value.plan : null));
export const draftView = computed(() => (draftPlan.value === null ? null : viewPlan(draftPlan.value)));

/** `what` names the thing that is changed: changes of it in quick succession are undone together, those of a gesture always. */
export function writeDraft(text: string, what: string | null = null, gesture = false): void {
  if (draftPlan.value === null) draftNumber.value++; // out of nothing: another plan
  history.value = reduceHistory(history.value, { type: "write", text, what, at: performance.now(), gesture });
}

/** Another plan in the place of the draft. That too can be undone. */
export function openDraft(text: string): void {
  draftNumber.value++;
  writeDraft(text);
}

/** Change the plan; nothing happens while the text is no plan. */
export function editPlan(change: (plan: PlanDocument) => PlanDocument, what: string | null = null, gesture = false): void {
  const plan = draftPlan.value;
  if (plan === null) return;
  const next = change(plan);
  if (next !== plan) writeDraft(planText(next), what, gesture);
}

export function undo(): void {
  history.value = reduceHistory(history.value, { type: "undo" });
}

export function redo(): void {
  history.value = reduceHistory(history.value, { type: "redo" });
}

export function planText(plan: PlanDocument): string {
  return JSON.stringify(plan, null, 2);
}

/** A reload of the page keeps the draft. */
export function keepDraftText(): void {
  effect(() => sessionStorage.setItem(KEY, draftText.value));
}
