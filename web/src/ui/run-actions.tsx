import type { Run } from "../api/types";
import { allowedActions } from "../state/runs";
import { RunActionButton } from "./run-action-button";

/** What can be told to the vehicle of a run now; `rallyPoints` are those of its plan. */
export function RunActions({ run, rallyPoints }: { run: Run; rallyPoints: number }) {
  const actions = allowedActions(run, rallyPoints);
  if (actions.length === 0) return null;
  return (
    <div class="actions run-actions" aria-label={`Commands to ${run.vehicle_id}`} role="group">
      {actions.map((action) => (
        <RunActionButton key={action} run={run} action={action} />
      ))}
    </div>
  );
}
