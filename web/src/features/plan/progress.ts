/** How far a run is with each item of its plan. Pure. */

import type { Run, RunState } from "../../api/types";
import { alternateOf, type PlanItemView, type PlanView } from "./document";

export type Progress = "ahead" | "current" | "done";

/** How far a run is with each item of its plan; without a run all is ahead. */
export function itemProgress(plan: PlanView, run: Run | null): Map<string, Progress> {
  const done = new Set(run?.flown_item_ids ?? []);
  const current = run === null ? null : currentItem(plan, run);
  const isCurrent = (item: PlanItemView) =>
    current !== null && (item.id === current || alternateOf(item)?.id === current); // at its other place
  return new Map(
    plan.items.map((item) => [item.id, isCurrent(item) ? "current" : done.has(item.id) ? "done" : "ahead"]),
  );
}

const IN_MISSION: ReadonlySet<RunState> = new Set(["starting", "flying", "at_drop", "paused"]);

/** The item under way. For the vehicle a return is done as soon as it begins; for people it lasts until the landing. */
function currentItem(plan: PlanView, run: Run): string | null {
  if (run.state === "returning")
    return run.commanded === null ? (plan.items.find(({ type }) => type === "return_to_launch")?.id ?? null) : null;
  return IN_MISSION.has(run.state) ? run.item_id : null;
}
