/** What was tried and not done, for people. Pure. */

import type { Answer } from "./frames";

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
