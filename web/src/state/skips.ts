/** Where a run in flight may skip to, and what it would leave out. The service decides; this keeps useless choices away. Pure. */

import type { Run } from "../api/types";
import { alternateOf, type PlanItemView, type PlanView } from "../plan/document";

/** Near the ground a mission cannot be changed. */
const NEAR_GROUND: ReadonlySet<string> = new Set(["takeoff", "land", "return_to_launch"]);
/** Items that are about the way to another one: nobody skips to them. */
const NO_STOPS: ReadonlySet<string> = new Set(["takeoff", "jump", "change_speed", "transition"]);

/** The items behind the one that is flown now; none while it is not known which that is, or nothing may be changed. */
export function skipTargets(plan: PlanView, run: Run): readonly PlanItemView[] {
  const current = currentItem(plan, run);
  if ((run.state !== "flying" && run.state !== "paused") || run.changing !== null) return [];
  if (current === null || NEAR_GROUND.has(current.type)) return [];
  return plan.items.filter((item) => item.index > current.index && !NO_STOPS.has(item.type) && !isOver(run, item.id));
}

/** Drops that are still open and would never be flown: they lie before the item that is skipped to. */
export function skippedDrops(plan: PlanView, run: Run, target: PlanItemView): readonly string[] {
  const current = currentItem(plan, run);
  if (current === null) return [];
  const between = plan.items.filter(({ index }) => index >= current.index && index < target.index).map(({ id }) => id);
  return between.filter((id) => run.drops.some((drop) => drop.plan_item_id === id && drop.outcome === "pending"));
}

function currentItem(plan: PlanView, run: Run): PlanItemView | null {
  const id = run.item_id;
  return id === null ? null : (plan.items.find((item) => item.id === id || alternateOf(item)?.id === id) ?? null);
}

/** A drop that has an outcome is never visited again. */
function isOver(run: Run, id: string): boolean {
  return run.drops.some((drop) => drop.plan_item_id === id && (drop.outcome === "released" || drop.outcome === "unknown"));
}
