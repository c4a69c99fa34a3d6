import type { Finding } from "../api/types";
import { asSentence } from "../format/words";
import { Icon } from "./icons";

export function FindingNote({ finding }: { finding: Finding }) {
  const error = finding.severity === "error";
  return (
    <div class={`finding ${error ? "tone-danger" : "tone-warn"}`}>
      <Icon name={error ? "error" : "warning"} size={16} />
      <div>
        <p>
          <span class="visually-hidden">{error ? "Error: " : "Warning: "}</span>
          {asSentence(finding.message)}
        </p>
        {finding.hint !== "" && <p class="hint">{asSentence(finding.hint)}</p>}
        <code>
          {finding.code}
          {finding.pointer !== "" && ` at ${finding.pointer}`}
        </code>
      </div>
    </div>
  );
}
