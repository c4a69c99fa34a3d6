import type { Finding } from "../api/types";
import { capitalize } from "../format/text";
import { Icon } from "./icons";

/** `folded` shows what is to be done about it only when asked: for warnings that stand beside many plans. */
export function FindingNote({ finding, folded = false }: { finding: Finding; folded?: boolean }) {
  const error = finding.severity === "error";
  if (folded) {
    return (
      <div class={`finding folded ${error ? "tone-danger" : "tone-warn"}`}>
        <Icon name={error ? "error" : "warning"} size={16} />
        <details>
          <summary>
            <Message finding={finding} />
          </summary>
          <WhatToDo finding={finding} />
        </details>
      </div>
    );
  }
  return (
    <div class={`finding ${error ? "tone-danger" : "tone-warn"}`}>
      <Icon name={error ? "error" : "warning"} size={16} />
      <div>
        <p>
          <Message finding={finding} />
        </p>
        <WhatToDo finding={finding} />
      </div>
    </div>
  );
}

function Message({ finding: { severity, message } }: { finding: Finding }) {
  return (
    <>
      <span class="visually-hidden">{severity === "error" ? "Error: " : "Warning: "}</span>
      {capitalize(message)}
    </>
  );
}

const MOST_NAMED = 3;

/** Unknown facts of the vehicle: a prediction assumes dozens. */
function assumedText(names: readonly string[]): string {
  const more = names.length - MOST_NAMED;
  return `Assumed: ${names.slice(0, MOST_NAMED).join(", ")}${more > 0 ? ` and ${more} more` : ""}`;
}

function WhatToDo({ finding: { hint, code, pointer, assumed } }: { finding: Finding }) {
  return (
    <>
      {assumed.length > 0 && <p class="hint">{assumedText(assumed)}</p>}
      {hint !== "" && <p class="hint">{capitalize(hint)}</p>}
      <code title={pointer === "" ? undefined : `At ${pointer} of the JSON document`}>{code}</code>
    </>
  );
}
