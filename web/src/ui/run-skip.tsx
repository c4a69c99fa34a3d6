import { useState } from "preact/hooks";
import { api } from "../api/client";
import { asProblem, type ProblemError } from "../api/problem";
import type { Run } from "../api/types";
import { pageWords } from "../format/page-words";
import { asSentence } from "../format/words";
import { itemTitle } from "../plan/describe";
import type { PlanView } from "../plan/document";
import { may } from "../state/principal";
import { skippedDrops, skipTargets } from "../state/skips";
import { dispatch, live } from "../state/store";
import { FindingNote } from "./finding-note";
import { HoldButton } from "./hold-button";

/** Go on with a later item of the plan: chosen first, then held to confirm. What the service refuses is said here. */
export function RunSkip({ run, plan }: { run: Run; plan: PlanView }) {
  const [chosen, choose] = useState("");
  const [busy, setBusy] = useState(false);
  const [refusal, setRefusal] = useState<{ readonly to: string; readonly problem: ProblemError } | null>(null);
  const targets = may("pilot") ? skipTargets(plan, run) : [];
  const target = targets.find(({ id }) => id === chosen) ?? null;
  if (targets.length === 0 && refusal === null) return null;
  const skip = async (to: string) => {
    setBusy(true);
    setRefusal(null);
    try {
      dispatch({ type: "run_read", run: await api.skipTo(run.id, to) });
      choose("");
    } catch (error) {
      setRefusal({ to, problem: asProblem(error) });
    } finally {
      setBusy(false);
    }
  };
  const leftOut = target === null ? [] : skippedDrops(plan, run, target);
  return (
    <section class="run-skip" aria-label={`Skip items of ${run.vehicle_id}`}>
      {targets.length > 0 && (
        <select aria-label="Skip to an item" value={target?.id ?? ""} onChange={(event) => choose(event.currentTarget.value)}>
          <option value="">Skip to…</option>
          {targets.map((item) => (
            <option key={item.id} value={item.id}>
              {item.index + 1}. {itemTitle(item)} · {item.id}
            </option>
          ))}
        </select>
      )}
      {target !== null && (
        <HoldButton key={target.id} verb={`Skip to ${target.id} with`} vehicle={run.vehicle_id} tone="warn" disabled={busy || !live.value} onConfirm={() => void skip(target.id)} />
      )}
      {leftOut.length > 0 && (
        <p class="run-skip-note tone-warn" role="status">
          Not dropped then: {leftOut.join(", ")}. What hangs there stays on board.
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
        {vehicle} does not skip to {to}
      </b>
      <p>{asSentence(problem.detail === "" ? problem.title : problem.detail)}</p>
      {problem.hint !== "" && <p>{asSentence(pageWords(problem.hint))}</p>}
      {problem.findings.map((finding) => (
        <FindingNote key={finding.code + finding.pointer} finding={finding} />
      ))}
      <code>{problem.code}</code>
    </div>
  );
}
