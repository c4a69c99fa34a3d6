/** Problems shown to the operator until dismissed, newest last, few at a time. */

import { signal } from "@preact/signals";
import { type ProblemError, toProblem } from "../api/problem";

interface Notice {
  readonly id: number;
  /** What was tried: "Start v1". */
  readonly action: string;
  readonly problem: ProblemError;
}

const LIMIT = 3;
let nextId = 1;

export const notices = signal<readonly Notice[]>([]);

export function reportProblem(action: string, error: unknown): void {
  const notice = { id: nextId++, action, problem: toProblem(error) };
  notices.value = [...notices.value.filter((other) => other.action !== action), notice].slice(-LIMIT);
}

export function dismiss(id: number): void {
  notices.value = notices.value.filter((notice) => notice.id !== id);
}
