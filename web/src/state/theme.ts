/** Dark or light: as the system says until somebody chooses otherwise. */

import { computed, effect, signal } from "@preact/signals";

export type Theme = "dark" | "light";

const KEY = "waydrop.theme";
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
    if (chosen.value === null) localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, chosen.value);
  });
}

function readChoice(): Theme | null {
  const kept = localStorage.getItem(KEY);
  return kept === "dark" || kept === "light" ? kept : null;
}
