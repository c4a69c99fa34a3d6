/** Stored plans: the list to choose from, and each plan read once (plans never change after they are stored). */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { PlanHead, StoredPlan } from "../api/types";
import { report } from "./notices";
import { feed, live } from "./store";

export const storedPlans = signal<readonly PlanHead[] | null>(null);
export const plansById = signal<Readonly<Record<string, StoredPlan>>>({});

const asked = new Set<string>();

/** Read a plan unless it is here or on its way. */
export function needPlan(id: string): void {
  if (id in plansById.value || asked.has(id)) return;
  asked.add(id);
  api
    .plan(id)
    .then(keepPlan)
    .catch((error: unknown) => report(`Read plan ${id}`, error))
    .finally(() => asked.delete(id));
}

export function keepPlan(plan: StoredPlan): void {
  plansById.value = { ...plansById.value, [plan.id]: plan };
}

export async function readStoredPlans(): Promise<void> {
  try {
    storedPlans.value = await api.plans();
  } catch (error) {
    report("Read the stored plans", error);
  }
}

// What the stored plans are called: as they were listed, and as the events since then tell.

/** As text: most events tell of no plan, and nothing is drawn anew for those. */
const told = computed(() =>
  JSON.stringify(
    feed.value.flatMap(({ kind, data }) => (kind === "plan.created" ? [[data["plan_id"], data["name"]]] : [])),
  ),
);

const names = computed(
  () =>
    new Map<string, string>([
      ...(JSON.parse(told.value) as [string, string][]),
      ...(storedPlans.value ?? []).map(({ id, name }) => [id, name] as const),
    ]),
);

/** Null for a plan of which nothing was heard. */
export function planName(id: string): string | null {
  return names.value.get(id) ?? null;
}

/** The list is read with each connection. */
export function watchPlanNames(): void {
  effect(() => {
    if (live.value) void readStoredPlans();
  });
}
