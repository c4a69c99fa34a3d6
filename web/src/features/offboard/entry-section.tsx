import type { EntryCheck } from "../../api/types";
import { capitalize, toSentence, toSentences } from "../../format/text";
import { planName } from "../../store/plans";
import { live } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { allowedActions, RunActionButton } from "../run/run-actions";
import { checkEntry, checkingEntry, controlMethod, entryCheck, needsTask, sticksHeld, tasksOnly } from "./capabilities";
import { enterOffboard, releaseLease } from "./control-session";
import { controlledRun } from "./control-state";
import { describeRunInTheWay } from "./labels";

/** With the lease: what an entry would find now, as the vehicle says it, and the entry. */
export function EntrySection({ vehicle }: { vehicle: string }) {
  const found = entryCheck.value;
  return (
    <>
      <section aria-labelledby="entry-title" class="entry-check">
        <h4 id="entry-title">
          {tasksOnly.value ? `Before ${vehicle} flies its tasks` : `Before you control ${vehicle}`}
          <button type="button" class="small" disabled={checkingEntry.value} onClick={() => void checkEntry()}>
            Check again
          </button>
        </h4>
        {found === null && <p>{checkingEntry.value ? "Reading parameters…" : "Not checked."}</p>}
        {found !== null && <EntryBlocker vehicle={vehicle} found={found} />}
        <ul class="audit">
          {found?.audit.map((entry) => (
            <AuditedParameter key={entry.parameter} entry={entry} />
          ))}
        </ul>
        {found?.control_method !== "commands" && (
          <label class="check-line">
            <input
              type="checkbox"
              checked={sticksHeld.value}
              onChange={(event) => (sticksHeld.value = event.currentTarget.checked)}
            />
            <span>An RC pilot is ready at the transmitter</span>
          </label>
        )}
      </section>
      <div class="actions">
        <HoldButton
          verb="Take control of"
          vehicle={vehicle}
          tone="warn"
          primary={!needsTask.value}
          disabled={found?.ready !== true || !live.value || needsTask.value}
          onConfirm={() => void enterOffboard()}
        />
        <button type="button" class="small" onClick={releaseLease}>
          Release the lease
        </button>
      </div>
      <p class="hint">{entryHint(vehicle)}</p>
    </>
  );
}

function AuditedParameter({ entry }: { entry: EntryCheck["audit"][number] }) {
  const [look, icon] = auditLook(entry);
  return (
    <li class={look}>
      <Icon name={icon} size={15} />
      <code>{entry.parameter}</code>
      <b>{entry.value ?? "–"}</b>
      <small>{capitalize(entry.meaning)}</small>
    </li>
  );
}

function auditLook({ blocks, doubtful, value }: EntryCheck["audit"][number]) {
  if (blocks) return ["blocks", "error"] as const;
  if (doubtful) return ["doubtful", "warning"] as const;
  return value === null ? (["unknown", "minus"] as const) : (["", "check"] as const);
}

function entryHint(vehicle: string): string {
  if (!tasksOnly.value)
    return `${vehicle} holds first, then follows your controls. If you let go or look away, it holds again.`;
  if (needsTask.value)
    return `Queue a task first: ${vehicle} cannot stop in the air, and without a task nothing is sent to it.`;
  return controlMethod.value === "commands"
    ? `${vehicle} holds by circling, then flies its tasks. Without a task it circles.`
    : `${vehicle} holds first, then flies its tasks.`;
}

const WAYS_OUT: readonly (readonly ["pause" | "abort", string])[] = [
  ["pause", "Pause the run first. You keep the lease meanwhile."],
  ["abort", "Abort the run, or start it and pause it in flight."],
];

/** Why an entry would be refused, and what helps. From here a run is paused, or aborted if it does not fly yet. */
function EntryBlocker({ vehicle, found }: { vehicle: string; found: EntryCheck }) {
  const run = controlledRun.value;
  if (found.ready) return null;
  if (run === null || found.run_id !== run.id) {
    return <Reason what={toSentence(found.reason)} hint={toSentences(found.hint)} />;
  }
  const way = WAYS_OUT.find(([action]) => allowedActions(run).includes(action));
  return (
    <>
      <Reason
        what={describeRunInTheWay(vehicle, run.state, planName(run.plan_id))}
        hint={way?.[1] ?? "You can take control while a run is paused, or without a run."}
      />
      {way !== undefined && (
        <div class="actions">
          <RunActionButton key={run.id} run={run} action={way[0]} />
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
