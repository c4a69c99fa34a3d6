/** Which drops wait for an operator's consent, and how long they still do. Pure. */

import type { ConsentRecord, DropRecord, Run } from "../api/types";
import { isOver } from "./runs";

/** A question that can be answered: the vehicle holds at its drop and waits. */
export interface Question {
  readonly run: Run;
  readonly drop: DropRecord;
  readonly consent: ConsentRecord;
}

/** Of one run, in the order of its drops. */
export function questionsOf(run: Run): Question[] {
  if (isOver(run)) return [];
  return run.drops.flatMap((drop) => (drop.consent?.state === "asked" ? [{ run, drop, consent: drop.consent }] : []));
}

/** Of all runs, the most urgent first. */
export function openQuestions(runs: Readonly<Record<string, Run>>): Question[] {
  const all = Object.values(runs).flatMap(questionsOf);
  return all.sort((a, b) => (a.consent.deadline_at ?? Infinity) - (b.consent.deadline_at ?? Infinity));
}

/** Seconds that are left to answer, by the service's clock; null if one of the two is not known. */
export function secondsLeft(consent: ConsentRecord, serviceNow_s: number | null): number | null {
  return consent.deadline_at === null || serviceNow_s === null ? null : Math.max(0, consent.deadline_at - serviceNow_s);
}
