/** Problems shown to the operator until dismissed, newest last, few at a time. */

import { signal } from "@preact/signals";
import { asProblem, type ProblemError } from "../api/problem";

export interface Notice {
  readonly id: number;
  /** What was tried: "Start v1". */
  readonly doing: string;
  readonly problem: ProblemError;
}

const LIMIT = 3;
let nextId = 1;

export const notices = signal<readonly Notice[]>([]);

export function report(doing: string, error: unknown): void {
  const notice = { id: nextId++, doing, problem: asProblem(error) };
  notices.value = [...notices.value.filter((other) => other.doing !== doing), notice].slice(-LIMIT);
}

export function dismiss(id: number): void {
  notices.value = notices.value.filter((notice) => notice.id !== id);
}
