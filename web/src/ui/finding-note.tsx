import type { Finding } from "../api/types";
import { asSentence } from "../format/words";
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
      {asSentence(message)}
    </>
  );
}

function WhatToDo({ finding: { hint, code, pointer } }: { finding: Finding }) {
  return (
    <>
      {hint !== "" && <p class="hint">{asSentence(hint)}</p>}
      <code>
        {code}
        {pointer !== "" && ` at ${pointer}`}
      </code>
    </>
  );
}
