/** Predicted against flown in words. Pure. */

import type { DropComparison, ItemComparison } from "../api/types";
import { reasonWords } from "../format/reasons";
import { seconds } from "../format/units";
import type { Tone } from "../format/words";

const PROMISED_PERCENT = 15;
const RESOLVED_S = 1; // a link shows the current item once a second

export function visitName(item: ItemComparison): string {
  return item.visit === 1 ? item.item_id : `${item.item_id} (visit ${item.visit})`;
}

/** A difference that a link cannot show is none. */
export function differenceWords(item: ItemComparison): string {
  if (item.flown_s === null) return reasonWords(item.reason);
  if (item.difference_percent === null) return "";
  const rounded = Math.round(item.difference_percent);
  const unsure = item.unsure_s > 0 ? ` ± ${Math.round(item.unsure_s)} s` : "";
  return `${rounded > 0 ? "+" : ""}${rounded} %${unsure}`;
}

/** A pause that is worth a word; empty: none. Times are told without it. */
export function pausedWords(paused_s: number): string {
  return paused_s < RESOLVED_S / 2 ? "" : `Paused for ${seconds(Math.round(paused_s))}, not counted.`;
}

/** Whether an item was not flown, for a reason that needs a line of its own. */
export function hasSentence(item: ItemComparison): boolean {
  return item.flown_s === null && item.reason !== null && item.reason.code !== "comparison.not_flown_yet";
}

/** Whether the table says already why there is nothing to compare of a drop. */
export function isTold(drop: DropComparison, items: readonly ItemComparison[]): boolean {
  return drop.apart_m === null && items.some((item) => item.item_id === drop.item_id && hasSentence(item) && reasonWords(item.reason) === reasonWords(drop.reason));
}

export function differenceTone(item: ItemComparison): Tone {
  if (item.flown_s === null || item.predicted_s === null) return "neutral";
  const allowed_s = Math.max((item.flown_s * PROMISED_PERCENT) / 100, RESOLVED_S) + item.unsure_s;
  return Math.abs(item.flown_s - item.predicted_s) <= allowed_s ? "ok" : "warn";
}
