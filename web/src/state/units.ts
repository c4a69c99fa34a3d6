/** The units on the page: chosen in the header, kept for the next time. */

import { effect } from "@preact/signals";
import { SYSTEMS, systemName, type SystemName } from "../format/units";

const KEY = "waydrop.units";

export function chooseUnits(name: string): void {
  if (isSystem(name)) systemName.value = name;
}

export function keepUnits(): void {
  chooseUnits(localStorage.getItem(KEY) ?? "");
  effect(() => localStorage.setItem(KEY, systemName.value));
}

function isSystem(name: string): name is SystemName {
  return Object.hasOwn(SYSTEMS, name);
}
