/** Stored plans: the list to choose from, and each plan read once (plans never change after they are stored). */

import { batch, computed, effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { PlanHead, PlansPage, StoredPlan } from "../api/types";
import { reportProblem } from "./notices";
import { feed, live } from "./store";

/** The newest ones; null until read. */
export const storedPlans = signal<readonly PlanHead[] | null>(null);
/** What to ask for the older ones with; null: there are none. */
export const olderPlans = signal<string | null>(null);
/** The last that were read. */
export const plansById = signal<Readonly<Record<string, StoredPlan>>>({});

/** A run that follows a moving target gets another plan every few seconds. */
export const MOST_PLANS = 100;

const asked = new Set<string>();

/** Read a plan unless it is here or on its way. */
export function loadPlan(id: string): void {
  if (id in plansById.value || asked.has(id)) return;
  asked.add(id);
  api
    .plan(id)
    .then(cachePlan)
    .catch((error: unknown) => reportProblem(`Load plan ${id}`, error))
    .finally(() => asked.delete(id));
}

export function cachePlan(plan: StoredPlan): void {
  const others = Object.entries(plansById.value).filter(([id]) => id !== plan.id);
  plansById.value = { ...Object.fromEntries(others.slice(1 - MOST_PLANS)), [plan.id]: plan };
}

export async function loadStoredPlans(): Promise<void> {
  try {
    showPlans([], await api.plans(null));
  } catch (error) {
    reportProblem("Load the stored plans", error);
  }
}

export async function loadOlderPlans(): Promise<void> {
  const next = olderPlans.peek();
  if (next === null) return;
  try {
    const page = await api.plans(next);
    if (olderPlans.peek() === next) showPlans(storedPlans.peek() ?? [], page); // not if it was asked for twice
  } catch (error) {
    reportProblem("Load the stored plans", error);
  }
}

function showPlans(newer: readonly PlanHead[], { plans, next }: PlansPage): void {
  batch(() => {
    storedPlans.value = [...newer, ...plans];
    olderPlans.value = next;
  });
}

// The names of the stored plans: from their list, from the events since then, and from those that were read.

/** As text, so that an event without a plan changes nothing. */
const namesInEvents = computed(() =>
  JSON.stringify(
    feed.value.flatMap(({ kind, data }) => (kind === "plan.created" ? [[data["plan_id"], data["name"]]] : [])),
  ),
);

const names = computed(
  () =>
    new Map<string, string>([
      ...(JSON.parse(namesInEvents.value) as [string, string][]),
      ...Object.values(plansById.value).map(({ id, name }) => [id, name] as const),
      ...(storedPlans.value ?? []).map(({ id, name }) => [id, name] as const),
    ]),
);

/** Null for an unknown plan. */
export function planName(id: string): string | null {
  return names.value.get(id) ?? null;
}

/** The list is read with each connection. */
export function watchPlanNames(): void {
  effect(() => {
    if (live.value) void loadStoredPlans();
  });
}
