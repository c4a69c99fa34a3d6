import type { EntryCheck } from "../../api/types";
import { asSentence, fullSentence, runStateName } from "../../format/labels";
import { pageWords } from "../../format/page-words";
import { planName } from "../../store/plans";
import { live } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { allowedActions, RunActionButton } from "../run/run-actions";
import { checkEntry, checking, entryCheck, flownBy, needsTask, sticksHeld, tasksOnly } from "./capabilities";
import { enter, giveBack } from "./control-session";
import { controlledRun } from "./control-state";

/** With the lease: what an entry would find now, as the vehicle says it, and the entry. */
export function OffboardEntry({ vehicle }: { vehicle: string }) {
  const found = entryCheck.value;
  return (
    <>
      <section aria-labelledby="entry-title" class="entry-check">
        <h4 id="entry-title">
          Before {vehicle} {tasksOnly.value ? "flies its tasks" : "enters manual control"}
          <button type="button" class="small" disabled={checking.value} onClick={() => void checkEntry()}>
            Check again
          </button>
        </h4>
        {found === null && <p>{checking.value ? "Reading its parameters…" : "Not checked."}</p>}
        {found !== null && <OffboardInTheWay vehicle={vehicle} found={found} />}
        <ul class="audit">
          {found?.audit.map(({ parameter, value, blocks, meaning }) => (
            <li key={parameter} class={blocks ? "blocks" : value === null ? "unknown" : ""}>
              <Icon name={blocks ? "error" : value === null ? "minus" : "check"} size={15} />
              <code>{parameter}</code>
              <b>{value ?? "–"}</b>
              <small>{asSentence(meaning)}</small>
            </li>
          ))}
        </ul>
        {found?.flown_by !== "commands" && (
          <label class="check-line">
            <input
              type="checkbox"
              checked={sticksHeld.value}
              onChange={(event) => (sticksHeld.value = event.currentTarget.checked)}
            />
            <span>A pilot holds the sticks of the RC sender</span>
          </label>
        )}
      </section>
      <div class="actions">
        <HoldButton
          verb="Take control of"
          vehicle={vehicle}
          tone="warn"
          disabled={found?.ready !== true || !live.value || needsTask.value}
          onConfirm={() => void enter()}
        />
        <button type="button" class="small" onClick={giveBack}>
          Give the lease back
        </button>
      </div>
      <p class="hint">{whatFollows(vehicle)}</p>
    </>
  );
}

function whatFollows(vehicle: string): string {
  if (!tasksOnly.value)
    return `${vehicle} holds first, then follows your controls. If you let go or look away, it holds again.`;
  if (needsTask.value)
    return `Queue a task first: ${vehicle} cannot stand still, and without a task nobody speaks for it.`;
  return flownBy.value === "commands"
    ? `${vehicle} is told to hold, which a wing does by circling, then flies its tasks; without one it circles.`
    : `${vehicle} is told to hold, then flies its tasks.`;
}

/**
 * Why an entry would be refused, and what helps. A run that flies is paused from here, and the lease kept meanwhile.
 */
export function OffboardInTheWay({ vehicle, found }: { vehicle: string; found: EntryCheck }) {
  const run = controlledRun.value;
  if (found.reason === "") return null;
  if (run === null || found.run_id !== run.id) {
    return (
      <Reason
        what={fullSentence(pageWords(found.reason))}
        hint={found.hint === "" ? "" : fullSentence(pageWords(found.hint))}
      />
    );
  }
  const mayPause = allowedActions(run).includes("pause");
  const name = planName(run.plan_id);
  const state = mayPause ? "" : `: ${runStateName(run.state).toLowerCase()}`;
  const what = `${vehicle} flies ${name === null ? "a run" : `“${name}”`}${state}.`;
  const hint = mayPause
    ? "Pause it first; the lease is kept meanwhile."
    : "Control is taken while a run is paused, or without one.";
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
