import { asSentence } from "../format/words";
import { enter, giveBack } from "../state/hands-session";
import { checkEntry, checking, entryCheck, flownBy, sticksHeld, tasksOnly } from "../state/offboard-facts";
import { needsTask } from "../state/task-queue";
import { live } from "../state/store";
import { OffboardInTheWay } from "./hands-in-the-way";
import { HoldButton } from "./hold-button";
import { Icon } from "./icons";

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
            <input type="checkbox" checked={sticksHeld.value} onChange={(event) => (sticksHeld.value = event.currentTarget.checked)} />
            <span>A pilot holds the sticks of the RC sender</span>
          </label>
        )}
      </section>
      <div class="actions">
        <HoldButton verb="Take control of" vehicle={vehicle} tone="warn" disabled={found?.ready !== true || !live.value || needsTask.value} onConfirm={() => void enter()} />
        <button type="button" class="small" onClick={giveBack}>
          Give the lease back
        </button>
      </div>
      <p class="hint">{whatFollows(vehicle)}</p>
    </>
  );
}

function whatFollows(vehicle: string): string {
  if (!tasksOnly.value) return `${vehicle} is told to hold, then follows this page until you leave. Let go of the controls or look elsewhere, and it holds.`;
  if (needsTask.value) return `Queue a task first: ${vehicle} cannot stand still, and without a task nobody speaks for it.`;
  return flownBy.value === "commands" ? `${vehicle} is told to hold, which a wing does by circling, then flies its tasks; without one it circles.` : `${vehicle} is told to hold, then flies its tasks.`;
}
