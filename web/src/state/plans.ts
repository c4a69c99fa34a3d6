/** Stored plans: the list to choose from, and each plan read once (plans never change after they are stored). */

import { signal } from "@preact/signals";
import { api } from "../api/client";
import type { PlanHead, StoredPlan } from "../api/types";
import { report } from "./notices";

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
