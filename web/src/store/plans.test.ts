import { expect, it, vi } from "vitest";
import type { StoredPlan } from "../api/types";

/** Three plans in pages of two. */
const plans = async (older_than: string | null) =>
  older_than === null
    ? {
        plans: [
          { id: "p-4", name: "Newest" },
          { id: "p-3", name: "Newer" },
        ],
        next: "p-3",
      }
    : { plans: [{ id: "p-2", name: "Oldest" }], next: null };
vi.doMock("../api/client", () => ({ api: { plans } }));
const { cachePlan, loadOlderPlans, loadStoredPlans, MOST_PLANS, olderPlans, planName, plansById, storedPlans } =
  await import("./plans");

it("a plan that was read has a name, also if it is not in the list of plans", () => {
  expect(planName("p-1")).toBeNull();
  cachePlan({ id: "p-1", name: "Clinic run" } as StoredPlan);
  expect(planName("p-1")).toBe("Clinic run");
});

it("the list tells that there are older plans, and has them once they are asked for", async () => {
  await loadStoredPlans();
  expect([storedPlans.value?.length, olderPlans.value]).toEqual([2, "p-3"]);
  await Promise.all([loadOlderPlans(), loadOlderPlans()]);
  expect([storedPlans.value?.map(({ id }) => id), olderPlans.value]).toEqual([["p-4", "p-3", "p-2"], null]);
});

it("of the plans that were read the last are kept", () => {
  for (let i = 0; i < MOST_PLANS; i++) cachePlan({ id: `moved-${i}`, name: "" } as StoredPlan);
  cachePlan({ id: "moved-0", name: "" } as StoredPlan);
  cachePlan({ id: "newest", name: "" } as StoredPlan);
  expect(["moved-0", "moved-1", "newest"].map((id) => id in plansById.value)).toEqual([true, false, true]);
  expect(Object.keys(plansById.value)).toHaveLength(MOST_PLANS);
});
