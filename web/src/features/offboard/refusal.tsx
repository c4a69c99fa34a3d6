import { asSentence } from "../../format/labels";
import { pageWords } from "../../format/page-words";
import type { Answer } from "./socket";

/** What was asked and not done, with the reason. */
export function RefusalNote({ refusal }: { refusal: Refusal }) {
  return (
    <div class="offboard-note tone-danger" role="alert">
      <b>{refusal.doing}: refused</b>
      <p>{asSentence(refusal.detail)}.</p>
      {refusal.hint !== "" && <p>{asSentence(pageWords(refusal.hint))}.</p>}
      <code>{refusal.code}</code>
    </div>
  );
}

// What was tried and not done, for people. Pure.

export interface Refusal {
  /** What was tried: "Take the lease of v1". */
  readonly doing: string;
  readonly code: string;
  readonly detail: string;
  readonly hint: string;
}

export function refusalOf(doing: string, answer: Answer): Refusal {
  if (answer.type === "error") return { doing, code: answer.code, detail: answer.detail, hint: answer.hint };
  return { doing, code: "answer.unreadable", detail: `the service answered “${answer.type}”`, hint: "" };
}

/** Of this page, not of the service. */
export function ended(doing: string, detail: string): Refusal {
  return { doing, code: "control.ended", detail, hint: "" };
}
