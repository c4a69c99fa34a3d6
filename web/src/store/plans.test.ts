import { expect, it } from "vitest";
import type { StoredPlan } from "../api/types";
import { cachePlan, planName } from "./plans";

it("a plan that was read has a name, also if it is not in the list of plans", () => {
  expect(planName("p-1")).toBeNull();
  cachePlan({ id: "p-1", name: "Clinic run" } as StoredPlan);
  expect(planName("p-1")).toBe("Clinic run");
});
