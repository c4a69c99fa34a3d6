import type { EntryCheck } from "../api/types";
import { pageWords } from "../format/page-words";
import { fullSentence, runStateName } from "../format/words";
import { controlledRun } from "../state/hands-on";
import { planName } from "../state/plan-names";
import { allowedActions } from "../state/runs";
import { Icon } from "./icons";
import { RunActionButton } from "./run-action-button";

/** Why an entry would be refused, and what helps. A run that flies is paused from here, and the lease kept meanwhile. */
export function OffboardInTheWay({ vehicle, found }: { vehicle: string; found: EntryCheck }) {
  const run = controlledRun.value;
  if (found.reason === "") return null;
  if (run === null || found.run_id !== run.id) {
    return <Reason what={fullSentence(pageWords(found.reason))} hint={found.hint === "" ? "" : fullSentence(pageWords(found.hint))} />;
  }
  const mayPause = allowedActions(run).includes("pause");
  const name = planName(run.plan_id);
  const what = `${vehicle} flies ${name === null ? "a run" : `“${name}”`}${mayPause ? "" : `: ${runStateName(run.state).toLowerCase()}`}.`;
  const hint = mayPause ? "Pause it first; the lease is kept meanwhile." : "Control is taken while a run is paused, or without one.";
  return (
    <>
      <Reason what={what} hint={hint} />
      {mayPause && (
        <div class="actions">
          <RunActionButton key={run.id} run={run} action="pause" />
        </div>
      )}
    </>
  );
}

function Reason({ what, hint }: { what: string; hint: string }) {
  return (
    <p class="entry-reason">
      <Icon name="error" size={16} />
      <span>
        {what}
        {hint !== "" && <small> {hint}</small>}
      </span>
    </p>
  );
}
