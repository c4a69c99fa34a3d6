import { ENTRY_STEPS } from "../hands-on/words";
import { manualControl, offboardNow } from "../state/hands-on";

/** How far an entry is. */
export function OffboardSteps() {
  if (manualControl.value.phase === "leaving") return <p role="status">Leaving…</p>;
  const now = ENTRY_STEPS.findIndex(([state]) => state === offboardNow.value?.state);
  return (
    <ol class="steps" aria-label="Entry">
      {ENTRY_STEPS.map(([state, name], i) => (
        <li key={state} class={i < now ? "done" : i === now ? "current" : ""}>
          {name}
        </li>
      ))}
    </ol>
  );
}
