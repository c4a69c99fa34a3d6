/** A moving target in words: how it moves, how old that is, whether it is followed. Pure. */

import type { ShownTarget } from "../state/targets";
import { courseOf, speedOf, type Seen } from "../targets/following";
import { reasonWords } from "./reasons";
import { age, distance, heading, seconds, speed } from "./units";
import { fullSentence } from "./words";

/** Slower than this it has no course worth a number. */
const STANDS_M_S = 0.05;

export function motionWords({ target, age_s, stale }: Seen): string {
  if (target === null) return "Nothing was reported yet.";
  const { report } = target;
  const moves = speedOf(report) < STANDS_M_S ? "Stands" : `Moves at ${speed(speedOf(report))} towards ${heading(courseOf(report))}`;
  return `${moves}, reported ${age(age_s)} ago${stale ? ": too old to be followed or dropped at" : ""}.`;
}

/** `now` in Unix seconds; null if the service's time is not known. */
export function followedWords({ word }: ShownTarget, now: number | null): string {
  if (word === null) return "The waypoint is where it was planned.";
  if (word.kind === "stays") return fullSentence(`The waypoint stays: ${reasonWords(word.reason)}`);
  const left_s = now === null ? 0 : Math.round(word.meets_at - now);
  return `The waypoint was moved ${distance(word.from_planned_m)} from where it was planned${left_s > 0 ? `; they meet there in ${seconds(left_s)}` : ""}.`;
}
