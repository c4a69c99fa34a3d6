import { api } from "../../api/client";
import type { Run } from "../../api/types";
import { runStateLabel, runStateTone } from "../../format/labels";
import { countOf } from "../../format/text";
import { canStartTogether, commonStart, include, listedRuns } from "../../store/common-start";
import { commandVehicle } from "../../store/notices";
import { planName } from "../../store/plans";
import { selectedRun, selectRun } from "../../store/selection";
import { dispatch, live } from "../../store/store";
import { Badge } from "../../ui/badge";
import { HoldButton } from "../../ui/buttons";
import { mayAct } from "./run-actions";

/** All runs that are prepared or under way, one below the other; those that are ready can be started together. */
export function OpenRuns() {
  if (listedRuns.value.length === 0) return null;
  const chosen = commonStart.value;
  return (
    <section class="open-runs" aria-label="Open runs">
      <ul>
        {listedRuns.value.map((run) => (
          <li key={run.id} data-run={run.id} data-state={run.state}>
            {canStartTogether.value && run.state === "uploaded" && (
              <input
                type="checkbox"
                aria-label={`Include ${run.vehicle_id} in the start`}
                checked={chosen.includes(run)}
                onChange={(event) => include(run.id, event.currentTarget.checked)}
              />
            )}
            <OpenRun run={run} />
          </li>
        ))}
      </ul>
      {canStartTogether.value && (
        <HoldButton
          verb="Start"
          vehicle={flightsOf(chosen)}
          tone="ok"
          primary
          disabled={!live.value || chosen.length === 0 || !mayAct("start")}
          onConfirm={() => chosen.forEach((run) => void start(run))}
        />
      )}
    </section>
  );
}

/** "2 flights: v6, v7". */
export function flightsOf(chosen: readonly Run[]): string {
  const count = countOf(chosen.length, "flight");
  return chosen.length === 0 ? count : `${count}: ${chosen.map(({ vehicle_id }) => vehicle_id).join(", ")}`;
}

function OpenRun({ run }: { run: Run }) {
  return (
    <button type="button" aria-pressed={selectedRun.value?.id === run.id} onClick={() => selectRun(run.id)}>
      <b>{run.vehicle_id}</b>
      <span>
        {planName(run.plan_id) ?? "Run"}
        {run.item_id !== null && <small> “{run.item_id}”</small>}
      </span>
      <Badge tone={runStateTone(run.state)}>{runStateLabel(run.state)}</Badge>
    </button>
  );
}

/** One that is refused keeps no other on the ground. */
function start(run: Run): Promise<void> {
  return commandVehicle(`Start ${run.vehicle_id}`, run.vehicle_id, async () =>
    dispatch({ type: "run_read", run: await api.runAction(run.id, "start") }),
  );
}
