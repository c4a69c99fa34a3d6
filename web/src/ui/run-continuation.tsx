import type { Run } from "../api/types";
import { selectRun } from "../state/selection";
import { runs } from "../state/store";

/** Which run this one continues, and which continues it. */
export function RunContinuation({ run }: { run: Run }) {
  if (run.continues === null && run.continued_by === null) return null;
  return (
    <p class="run-continuation">
      {run.continues !== null && (
        <>
          Flies what was left of <RunLink id={run.continues} />.{" "}
        </>
      )}
      {run.continued_by !== null && (
        <>
          What was left is flown by <RunLink id={run.continued_by} />.
        </>
      )}
    </p>
  );
}

/** A run of which the page knows nothing is named only. */
function RunLink({ id }: { id: string }) {
  if (runs.value[id] === undefined) return <code>{id}</code>;
  return (
    <button type="button" class="run-link" onClick={() => selectRun(id)}>
      {id}
    </button>
  );
}
