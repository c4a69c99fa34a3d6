/**
 * Problems shown to the operator until dismissed, or until their vehicle obeys: newest last. Of those that are about no
 * vehicle only the newest few; the refusal of a command is never left out.
 */

import { signal } from "@preact/signals";
import { type ProblemError, toProblem } from "../api/problem";

interface Notice {
  readonly id: number;
  /** What was tried: "Start v1". */
  readonly action: string;
  readonly problem: ProblemError;
  /** Of a command to a vehicle. */
  readonly vehicle: string | null;
}

/** Of those about no vehicle. */
const LIMIT = 3;
let nextId = 1;

export const notices = signal<readonly Notice[]>([]);

export function reportProblem(action: string, error: unknown, vehicle: string | null = null): void {
  const notice = { id: nextId++, action, problem: toProblem(error), vehicle };
  const all = [...notices.value.filter((other) => other.action !== action), notice];
  const kept = new Set(all.filter((one) => one.vehicle === null).slice(-LIMIT));
  notices.value = all.filter((one) => one.vehicle !== null || kept.has(one));
}

export function dismiss(id: number): void {
  notices.value = notices.value.filter((notice) => notice.id !== id);
}

/** Sends a command: its failure is a notice. If it succeeds, what failed before it was sent is no news any more. */
export async function commandVehicle(action: string, vehicle: string, send: () => Promise<unknown>): Promise<void> {
  const next = nextId;
  try {
    await send();
    const isOld = (notice: Notice) => notice.vehicle === vehicle && notice.id < next;
    if (notices.peek().some(isOld)) notices.value = notices.peek().filter((notice) => !isOld(notice));
  } catch (error) {
    reportProblem(action, error, vehicle);
  }
}
