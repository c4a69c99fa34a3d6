import { expect, test } from "vitest";
import type { RunState } from "../../api/types";
import { viewPlan } from "../plan/document";
import { examplePlan } from "./example-plan";
import { describeStep, STEPS, stepOf } from "./steps";

const NOTHING = { vehicle: null, hasPlan: false, run: null };

test("each step follows from what was done, and a flight that was made counts before anything else", () => {
  const run = (state: RunState, started_at: number | null) => ({ state, started_at });
  const done = [
    NOTHING,
    { ...NOTHING, vehicle: "v1" },
    { ...NOTHING, vehicle: "v1", hasPlan: true },
    { ...NOTHING, vehicle: "v1", hasPlan: true, run: run("aborted", null) },
    { ...NOTHING, run: run("uploaded", null) },
    { ...NOTHING, run: run("at_drop", 5) },
    { ...NOTHING, run: run("completed", 5) },
  ];
  expect(done.map(stepOf)).toEqual([0, 1, 2, 2, 3, 4, STEPS]);
});

test("every step has its own title and says where to go", () => {
  const steps = [0, 1, 2, 3, 4, STEPS].map((step) => describeStep(step, "v7"));
  expect(new Set(steps.map(({ title }) => title)).size).toBe(STEPS + 1);
  expect(steps.map(({ act }) => act.view)).toEqual(["fleet", "plan", "plan", "run", "map", "run"]);
});

test("the example has one drop, 80 m from the place where the vehicle stands", () => {
  const plan = viewPlan(examplePlan({ latitude_deg: 47.4, longitude_deg: 8.5, altitude_m: 488 }));
  expect([plan.home, plan.items.map(({ type }) => type)]).toEqual([
    [8.5, 47.4],
    ["takeoff", "waypoint", "gripper", "return_to_launch"],
  ]);
  const [lon, lat] = plan.items[1]?.at ?? [0, 0];
  expect([lon, lat].map((degrees) => degrees.toFixed(4))).toEqual(["8.5008", "47.4005"]);
});
