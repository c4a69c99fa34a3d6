import { useState } from "preact/hooks";
import { api } from "../../api/client";
import { type ProblemError, toProblem } from "../../api/problem";
import type { Run } from "../../api/types";
import { capitalize, toSentence } from "../../format/text";
import { hasRole } from "../../store/principal";
import { dispatch, live } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { FindingNote } from "../../ui/finding-note";
import { alternateOf, type PlanItemView, type PlanView } from "../plan/document";
import { itemType } from "../plan/item-types";
import { itemTitle } from "../plan/labels";

/** Go on with a later item of the plan: chosen first, then held to confirm. What the service refuses is said here. */
export function RunSkip({ run, plan }: { run: Run; plan: PlanView }) {
  const [chosen, choose] = useState("");
  const [busy, setBusy] = useState(false);
  const [refusal, setRefusal] = useState<{ readonly to: string; readonly problem: ProblemError } | null>(null);
  const targets = hasRole("pilot") ? skipTargets(plan, run) : [];
  const target = targets.find(({ id }) => id === chosen) ?? null;
  if (targets.length === 0 && refusal === null) return null;
  const skip = async (to: string) => {
    setBusy(true);
    setRefusal(null);
    try {
      dispatch({ type: "run_read", run: await api.skipTo(run.id, to) });
      choose("");
    } catch (error) {
      setRefusal({ to, problem: toProblem(error) });
    } finally {
      setBusy(false);
    }
  };
  const leftOut = target === null ? [] : skippedDrops(plan, run, target);
  return (
    <section class="run-skip" aria-label={`Skip items of ${run.vehicle_id}`}>
      {targets.length > 0 && (
        <select
          aria-label="Skip to an item"
          value={target?.id ?? ""}
          onChange={(event) => choose(event.currentTarget.value)}
        >
          <option value="">Skip to…</option>
          {targets.map((item) => (
            <option key={item.id} value={item.id}>
              {item.index + 1}. {itemTitle(item)} · {item.id}
            </option>
          ))}
        </select>
      )}
      {target !== null && (
        <HoldButton
          key={target.id}
          verb={`Skip to ${target.id} with`}
          vehicle={run.vehicle_id}
          tone="warn"
          disabled={busy || !live.value}
          onConfirm={() => void skip(target.id)}
        />
      )}
      {leftOut.length > 0 && (
        <p class="run-skip-note tone-warn" role="status">
          Skips these drops: {leftOut.join(", ")}. Their parcels stay on board.
        </p>
      )}
      {refusal !== null && <Refused to={refusal.to} vehicle={run.vehicle_id} problem={refusal.problem} />}
    </section>
  );
}

function Refused({ to, vehicle, problem }: { to: string; vehicle: string; problem: ProblemError }) {
  return (
    <div class="form-problem" role="alert">
      <b>
        {vehicle} did not skip to {to}
      </b>
      <p>{capitalize(problem.detail === "" ? problem.title : problem.detail)}</p>
      {problem.hint !== "" && <p>{toSentence(problem.hint)}</p>}
      {problem.findings.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
      <code>{problem.code}</code>
    </div>
  );
}

// Where a run in flight may skip to, and what it would leave out. The service decides; this keeps useless choices
// away. Pure.

/** The items behind the one that is flown now; none while it is not known which that is, or nothing may be changed. */
export function skipTargets(plan: PlanView, run: Run): readonly PlanItemView[] {
  const current = currentItem(plan, run);
  if ((run.state !== "flying" && run.state !== "paused") || run.changing !== null) return [];
  if (current === null || itemType(current.type).near_ground) return [];
  return plan.items.filter(
    (item) => item.index > current.index && itemType(item.type).can_skip_to && !isOver(run, item.id),
  );
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
  return run.drops.some(
    (drop) => drop.plan_item_id === id && (drop.outcome === "released" || drop.outcome === "unknown"),
  );
}
