import type { ServerAnswer } from "../../api/types";
import { toSentence } from "../../format/text";

/** What was asked for and not done. */
export interface Refusal {
  /** "Take the lease of v1". */
  readonly action: string;
  readonly code: string;
  readonly detail: string;
  readonly hint: string;
}

export function toRefusal(action: string, answer: ServerAnswer): Refusal {
  if (answer.type === "error") return { action, code: answer.code, detail: answer.detail, hint: answer.hint };
  return {
    action,
    code: "answer.unreadable",
    detail: `the service answered “${answer.type}”`,
    hint: "reload the page",
  };
}

/** The page's own refusal: nothing reached the service, or no answer came back. */
export function controlEnded(action: string, detail: string): Refusal {
  return { action, code: "control.ended", detail, hint: "acquire the lease again" };
}

/** What was refused, why, and what to do about it. */
export function RefusalNote({ refusal: { action, code, detail, hint } }: { refusal: Refusal }) {
  return (
    <div class="offboard-note tone-danger" role="alert">
      <b>{action}: refused</b>
      <p>{toSentence(detail)}</p>
      {hint !== "" && <p>{toSentence(hint)}</p>}
      <code>{code}</code>
    </div>
  );
}
