import { toSentences } from "../../format/text";
import { readRun, unknownRunProblem } from "../../store/chosen-run";
import { chooseNoRun, vehicleId } from "../../store/selection";
import { live } from "../../store/store";
import { Icon } from "../../ui/icons";

/** In the place of a chosen run that the page does not know yet, or never will. */
export function UnknownRun({ id }: { id: string }) {
  const problem = unknownRunProblem.value;
  const missing = problem?.status === 404;
  return (
    <div class="panel-body empty-panel" role="status">
      <Icon name="run" size={40} />
      <h3>{problem === null ? "Loading the run" : missing ? "No such run" : "The run could not be loaded"}</h3>
      <p>
        <code>{id}</code>
      </p>
      {problem === null && !live.value && <p>It is loaded when the page is live.</p>}
      {missing && <p>This service does not have it. It may have been deleted by age.</p>}
      {problem !== null && !missing && <p>{toSentences(problem.title, problem.hint)}</p>}
      {problem !== null && !missing && (
        <button type="button" class="small" disabled={!live.value} onClick={() => void readRun(id)}>
          Try again
        </button>
      )}
      {problem !== null && (
        <button type="button" class="small" onClick={chooseNoRun}>
          Show the newest run{vehicleId.value !== null && ` of ${vehicleId.value}`}
        </button>
      )}
    </div>
  );
}
