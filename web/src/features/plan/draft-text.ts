/**
 * The text of the plan being prepared, with undo and redo. Whoever edits it, in the list, on the map or as JSON,
 * writes here.
 */

import { computed, effect, signal } from "@preact/signals";
import type { PlanDocument } from "../../api/types";
import { parsePlanText, viewPlan } from "./document";

const KEY = "waydrop.draft";
const SAVED_KEY = "waydrop.draft-saved";

const history = signal(startHistory(sessionStorage.getItem(KEY) ?? ""));
/** The text that exists elsewhere too: stored, in a file, or as it was opened. */
const saved = signal(sessionStorage.getItem(SAVED_KEY) === null ? "" : (sessionStorage.getItem(KEY) ?? ""));
/** Counts the plans that were opened: the map looks at each of them once. */
export const draftGeneration = signal(1);

export const draftText = computed(() => history.value.text);
export const isDraftUnsaved = computed(() => draftText.value.trim() !== "" && draftText.value !== saved.value);
export const canUndo = computed(() => history.value.past.length > 0);
export const canRedo = computed(() => history.value.future.length > 0);

export const parsedDraft = computed(() => parsePlanText(draftText.value));
export const draftPlan = computed<PlanDocument | null>(() =>
  parsedDraft.value !== null && "plan" in parsedDraft.value ? parsedDraft.value.plan : null,
);
export const draftView = computed(() => (draftPlan.value === null ? null : viewPlan(draftPlan.value)));

/**
 * `what` names the thing that is changed: changes of it in quick succession are undone together, those of a gesture
 * always.
 */
export function writeDraft(text: string, what: string | null = null, gesture = false): void {
  if (draftPlan.value === null) draftGeneration.value++; // out of nothing: another plan
  history.value = reduceHistory(history.value, { type: "write", text, what, at: performance.now(), gesture });
}

/** Another plan in the place of the draft. That too can be undone. Nobody's work is lost with it until it is edited. */
export function openDraft(text: string): void {
  draftGeneration.value++;
  writeDraft(text);
  markDraftSaved(text);
}

/** This text of the draft is stored or in a file now. */
export function markDraftSaved(text: string): void {
  saved.value = text;
}

/** Change the plan; nothing happens while the text is no plan. */
export function editPlan(
  change: (plan: PlanDocument) => PlanDocument,
  what: string | null = null,
  gesture = false,
): void {
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

/** A reload of the page keeps the draft. Who closes the page with one that is nowhere else is asked. */
export function persistDraft(): void {
  effect(() => sessionStorage.setItem(KEY, draftText.value));
  effect(() => {
    if (!isDraftUnsaved.value) {
      sessionStorage.setItem(SAVED_KEY, "yes");
      return undefined;
    }
    sessionStorage.removeItem(SAVED_KEY);
    const ask = (event: Event) => event.preventDefault();
    window.addEventListener("beforeunload", ask);
    return () => window.removeEventListener("beforeunload", ask);
  });
}

// The draft's text with undo and redo. The text is the truth, so list, map and JSON are always in step. Pure.

/**
 * Changes of one thing (typing into a field) closer together than this are undone as one; a drag always is, however
 * slow.
 */
const TOGETHER_MS = 1500;
const KEPT = 200;
/** Of all kept texts together, so that large plans do not fill the memory. */
const KEPT_CHARS = 10_000_000;

export interface History {
  readonly text: string;
  /** Oldest first. */
  readonly past: readonly string[];
  /** Next first. */
  readonly future: readonly string[];
  /** What was changed last, and when (ms): the next change of the same thing joins it. */
  readonly last: { readonly what: string; readonly at: number } | null;
}

type HistoryAction =
  | {
      readonly type: "write";
      readonly text: string;
      readonly what: string | null;
      readonly at: number;
      readonly gesture?: boolean;
    }
  | { readonly type: "undo" }
  | { readonly type: "redo" };

export function startHistory(text: string): History {
  return { text, past: [], future: [], last: null };
}

export function reduceHistory(history: History, action: HistoryAction): History {
  switch (action.type) {
    case "write":
      return write(history, action.text, action.what, action.at, action.gesture ?? false);
    case "undo": {
      const before = history.past.at(-1);
      if (before === undefined) return history;
      return { text: before, past: history.past.slice(0, -1), future: [history.text, ...history.future], last: null };
    }
    case "redo": {
      const [next, ...future] = history.future;
      if (next === undefined) return history;
      return { text: next, past: [...history.past, history.text], future, last: null };
    }
  }
}

function write(history: History, text: string, what: string | null, at: number, gesture: boolean): History {
  if (text === history.text) return history;
  const last = what === null ? null : { what, at };
  const joins = last !== null && history.last?.what === what && (gesture || at - history.last.at < TOGETHER_MS);
  const past = joins ? history.past : bounded([...history.past, history.text]);
  return { text, past, future: [], last };
}

/** The newest ones that there is room for; at least one, so that the last change can always be undone. */
function bounded(past: readonly string[]): readonly string[] {
  let from = past.length - 1;
  let chars = past[from]?.length ?? 0;
  while (from > 0 && past.length - from < KEPT && chars + (past[from - 1]?.length ?? 0) <= KEPT_CHARS)
    chars += past[--from]?.length ?? 0;
  return past.slice(from);
}
