/** Dark or light: that of the system until the user chooses. */

import { computed, effect, signal } from "@preact/signals";
import { UNIT_SYSTEMS, type UnitSystem, unitSystem } from "../format/units";

export type Theme = "dark" | "light";

const THEME_KEY = "waydrop.theme";
const prefersDark = matchMedia("(prefers-color-scheme: dark)");
const system = signal<Theme>(prefersDark.matches ? "dark" : "light");
const chosen = signal<Theme | null>(readChoice());

export const theme = computed<Theme>(() => chosen.value ?? system.value);

/** The other theme; choosing what the system has goes back to following the system. */
export function toggleTheme(): void {
  const other = theme.value === "dark" ? "light" : "dark";
  chosen.value = other === system.value ? null : other;
}

export function applyTheme(): void {
  prefersDark.addEventListener("change", () => (system.value = prefersDark.matches ? "dark" : "light"));
  effect(() => {
    document.documentElement.dataset["theme"] = theme.value;
    if (chosen.value === null) localStorage.removeItem(THEME_KEY);
    else localStorage.setItem(THEME_KEY, chosen.value);
  });
}

function readChoice(): Theme | null {
  const kept = localStorage.getItem(THEME_KEY);
  return kept === "dark" || kept === "light" ? kept : null;
}

// The units on the page: chosen in the header, kept for the next time.

const UNITS_KEY = "waydrop.units";

export function chooseUnits(name: string): void {
  if (isSystem(name)) unitSystem.value = name;
}

export function persistUnits(): void {
  chooseUnits(localStorage.getItem(UNITS_KEY) ?? "");
  effect(() => localStorage.setItem(UNITS_KEY, unitSystem.value));
}

function isSystem(name: string): name is UnitSystem {
  return Object.hasOwn(UNIT_SYSTEMS, name);
}
