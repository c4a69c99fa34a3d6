/** What the stored plans are called: as they were listed, and as the events since then tell. */

import { computed, effect } from "@preact/signals";
import { readStoredPlans, storedPlans } from "./plans";
import { feed, live } from "./store";

/** As text: most events tell of no plan, and nothing is drawn anew for those. */
const told = computed(() => JSON.stringify(feed.value.flatMap(({ kind, data }) => (kind === "plan.created" ? [[data["plan_id"], data["name"]]] : []))));

const names = computed(() => new Map<string, string>([...(JSON.parse(told.value) as [string, string][]), ...(storedPlans.value ?? []).map(({ id, name }) => [id, name] as const)]));

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
