import { expect, it, vi } from "vitest";
import type { PlanHead } from "../../api/types";

vi.stubGlobal("location", { hash: "" });
const { copyName, findPlans } = await import("./library");

const plan = (name: string, fields: Partial<PlanHead> = {}): PlanHead => ({
  id: name,
  hash: "",
  name,
  vehicle_type: "multicopter",
  created_at: 0,
  created_by: "desk",
  ...fields,
});

it("plans are found by words of their name, vehicle type and author, in any order", () => {
  const plans = [
    plan("Clinic run"),
    plan("Clinic pass", { vehicle_type: "fixed_wing" }),
    plan("Harbour", { created_by: "ann" }),
  ];
  const found = (query: string) => findPlans(plans, query).map(({ name }) => name);
  expect(found("")).toEqual(["Clinic run", "Clinic pass", "Harbour"]);
  expect(found("RUN clinic")).toEqual(["Clinic run"]);
  expect(found("fixed clinic")).toEqual(["Clinic pass"]);
  expect(found("ann")).toEqual(["Harbour"]);
  expect(found("no such plan")).toEqual([]);
});

it("a copy has a name of its own", () => {
  expect(copyName("Clinic run", [plan("Clinic run")])).toBe("Clinic run (copy)");
  expect(copyName("Clinic run", [plan("Clinic run"), plan("Clinic run (copy)")])).toBe("Clinic run (copy 2)");
  expect(copyName("Clinic run (copy 2)", [plan("Clinic run (copy)"), plan("Clinic run (copy 2)")])).toBe(
    "Clinic run (copy 3)",
  );
});
