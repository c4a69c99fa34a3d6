/** The stored plans: found by name, and copied under another one. A stored plan never changes: runs refer to it. */

import { signal } from "@preact/signals";
import { api } from "../../api/client";
import type { PlanHead } from "../../api/types";
import { vehicleTypeLabel } from "../../format/labels";
import { reportProblem } from "../../store/notices";
import { cachePlan, loadStoredPlans } from "../../store/plans";

/** Whether the library is shown. */
export const libraryShown = signal(false);
export const copyingPlan = signal(false);

/** Plans whose name, vehicle type or author has each word of the query, in any case. Pure. */
export function findPlans(plans: readonly PlanHead[], query: string): readonly PlanHead[] {
  const words = query.toLowerCase().split(/\s+/).filter(Boolean);
  return plans.filter(({ name, vehicle_type, created_by }) => {
    const text = `${name} ${vehicleTypeLabel(vehicle_type)} ${created_by}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

/** The name of a copy that no plan has yet: "Clinic run (copy)", "Clinic run (copy 2)". Pure. */
export function copyName(name: string, plans: readonly PlanHead[]): string {
  const base = name.replace(/ \(copy(?: \d+)?\)$/, "");
  const taken = new Set(plans.map((plan) => plan.name));
  const names = Array.from({ length: plans.length + 1 }, (_, i) => `${base} (copy${i === 0 ? "" : ` ${i + 1}`})`);
  return names.find((one) => !taken.has(one)) ?? names[0] ?? base;
}

/** Stores the plan once more under this name; true if it was stored. */
export async function copyPlan({ id, name }: PlanHead, newName: string): Promise<boolean> {
  copyingPlan.value = true;
  try {
    const { plan } = await api.plan(id);
    cachePlan(await api.createPlan({ ...plan, name: newName }));
    await loadStoredPlans();
    return true;
  } catch (error) {
    reportProblem(`Copy “${name}”`, error);
    return false;
  } finally {
    copyingPlan.value = false;
  }
}
