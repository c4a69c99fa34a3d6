import { expect, it, vi } from "vitest";
import type { StoredPlan } from "../../api/types";
import { sampleRun } from "../../testing/samples";
import { skipTargets } from "./run-skip";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { dispatch } = await import("../../store/store");
const { selectRun } = await import("../../store/selection");
const { cachePlan } = await import("../../store/plans");
const { runPlanView } = await import("./run-plan");

const ITEMS = ["bridge", "clinic"].map((id) => ({ id, type: "waypoint" }));
const PLAN = { items: ITEMS, rally_points: [{ latitude_deg: 47.4, longitude_deg: 8.5 }] };

it("while the next plan of a moving target is read, the run has the items and rally points of the one before", () => {
  const follow = (plan_id: string, updated_at: number) => {
    dispatch({ type: "run_read", run: sampleRun({ plan_id, updated_at, item_id: "bridge" }) });
    const plan = runPlanView.value;
    return [plan?.rallyPoints.length, plan && skipTargets(plan, sampleRun({ item_id: "bridge" })).map(({ id }) => id)];
  };
  cachePlan({ id: "p1", plan: PLAN } as unknown as StoredPlan);
  selectRun("r1");
  expect(follow("p1", 101)).toEqual([1, ["clinic"]]);
  expect(follow("moved", 102)).toEqual([1, ["clinic"]]);
  dispatch({ type: "run_read", run: sampleRun({ id: "other", plan_id: "unread" }) });
  selectRun("other");
  expect(runPlanView.value).toBeNull();
});
