/** The wind that checks, predictions and uploads of plans reckon with. A reload keeps it; a new session is calm. */

import { computed, effect, signal } from "@preact/signals";
import { systemName } from "../format/units";
import { CALM, windOf, type WindTexts } from "../plan/wind";

const KEY = "waydrop.wind";

export const windTexts = signal<WindTexts>(kept());
export const typedWind = computed(() => windOf(windTexts.value));
/** As text, so that what is typed and means the same checks nothing anew. */
const key = computed(() => JSON.stringify("wind" in typedWind.value ? typedWind.value.wind : null));
/** Null: calm air, also while what is typed is no wind. */
export const wind = computed(() => {
  void key.value;
  const typed = typedWind.peek();
  return "wind" in typed ? typed.wind : null;
});

export function typeWind(change: Partial<Pick<WindTexts, "from" | "speed">>): void {
  windTexts.value = { ...windTexts.value, ...change, ...(change.speed === undefined ? {} : { units: systemName.peek() }) };
}

export function calm(): void {
  windTexts.value = CALM;
}

export function keepWind(): void {
  effect(() => sessionStorage.setItem(KEY, JSON.stringify(windTexts.value)));
}

function kept(): WindTexts {
  try {
    const found: unknown = JSON.parse(sessionStorage.getItem(KEY) ?? "null");
    return isTexts(found) ? found : CALM;
  } catch {
    return CALM; // somebody else's text
  }
}

function isTexts(value: unknown): value is WindTexts {
  if (typeof value !== "object" || value === null) return false;
  const { from, speed, units } = value as Record<string, unknown>;
  return typeof from === "string" && typeof speed === "string" && (units === "metric" || units === "aviation" || units === "miles");
}
