/** A wind as it is typed: where it comes from, and how strong, in the units of the page. Pure. */

import { computed, effect, signal } from "@preact/signals";
import type { Wind } from "../../api/types";
import { UNIT_SYSTEMS, type UnitSystem, unitSystem } from "../../format/units";
import { Icon } from "../../ui/icons";

/** `units`: those in which the speed was typed, so that a switch of units changes no wind. */
interface WindInput {
  readonly from: string;
  readonly speed: string;
  readonly units: UnitSystem;
}

export const CALM: WindInput = { from: "", speed: "", units: "metric" };
/** The service takes no stronger one. */
const STRONGEST_M_S = 75;

type ParsedWind = { readonly wind: Wind | null } | { readonly error: string };

/** Nothing typed is calm air. */
export function parseWind({ from, speed, units }: WindInput): ParsedWind {
  if (from.trim() === "" && speed.trim() === "") return { wind: null };
  const { is, name } = UNIT_SYSTEMS[units].speed;
  const [from_deg, typed] = [numberOf(from), numberOf(speed)];
  if (from_deg === null || from_deg < 0 || from_deg > 360)
    return { error: "Enter where the wind comes from: 0 to 360 degrees (270 is west)." };
  const speed_m_s = typed === null ? null : typed * is;
  if (speed_m_s === null || speed_m_s < 0 || speed_m_s > STRONGEST_M_S)
    return { error: `Enter the wind speed: 0 to ${Math.floor(STRONGEST_M_S / is)} ${name}.` };
  return { wind: { from_deg, speed_m_s } };
}

/** The speed's text in other units; one that is no number stays as it is. */
export function speedText({ speed, units }: WindInput, shown: UnitSystem): string {
  const typed = numberOf(speed);
  if (units === shown || typed === null) return speed;
  return String(Number(((typed * UNIT_SYSTEMS[units].speed.is) / UNIT_SYSTEMS[shown].speed.is).toFixed(1)));
}

function numberOf(text: string): number | null {
  const value = text.trim() === "" ? Number.NaN : Number(text.trim().replace(",", "."));
  return Number.isFinite(value) ? value : null;
}

// The wind that checks, predictions and uploads of plans reckon with. A reload keeps it; a new session is calm.

const KEY = "waydrop.wind";

const windInput = signal<WindInput>(kept());
const parsedWind = computed(() => parseWind(windInput.value));
/** As text, so that what is typed and means the same checks nothing anew. */
const key = computed(() => JSON.stringify("wind" in parsedWind.value ? parsedWind.value.wind : null));
/** Null: calm air, also while what is typed is no wind. */
export const wind = computed(() => {
  void key.value;
  const typed = parsedWind.peek();
  return "wind" in typed ? typed.wind : null;
});

function setWindInput(change: Partial<Pick<WindInput, "from" | "speed">>): void {
  windInput.value = {
    ...windInput.value,
    ...change,
    ...(change.speed === undefined ? {} : { units: unitSystem.peek() }),
  };
}

function clearWind(): void {
  windInput.value = CALM;
}

export function persistWind(): void {
  effect(() => sessionStorage.setItem(KEY, JSON.stringify(windInput.value)));
}

function kept(): WindInput {
  try {
    const found: unknown = JSON.parse(sessionStorage.getItem(KEY) ?? "null");
    return isTexts(found) ? found : CALM;
  } catch {
    return CALM; // not written by this page
  }
}

function isTexts(value: unknown): value is WindInput {
  if (typeof value !== "object" || value === null) return false;
  const { from, speed, units } = value as Record<string, unknown>;
  return (
    typeof from === "string" &&
    typeof speed === "string" &&
    (units === "metric" || units === "aviation" || units === "miles")
  );
}

/** The wind that the prediction reckons with. */
export function WindFields() {
  const typed = parsedWind.value;
  const texts = windInput.value;
  const error = "error" in typed ? typed.error : "";
  const hint = wind.value === null ? "Calm air" : "Used for times, energy and drop points";
  return (
    <div class="wind" role="group" aria-label="Wind">
      <b>Wind</b>
      <label>
        from
        <input
          type="text"
          inputMode="decimal"
          autocomplete="off"
          size={3}
          placeholder="–"
          aria-label="Wind from, degrees"
          aria-invalid={error !== ""}
          aria-describedby="wind-note"
          value={texts.from}
          onInput={(event) => setWindInput({ from: event.currentTarget.value })}
        />
        °
      </label>
      <label>
        at
        <input
          type="text"
          inputMode="decimal"
          autocomplete="off"
          size={3}
          placeholder="–"
          aria-label={`Wind speed, ${UNIT_SYSTEMS[unitSystem.value].speed.name}`}
          aria-invalid={error !== ""}
          aria-describedby="wind-note"
          value={speedText(texts, unitSystem.value)}
          onInput={(event) => setWindInput({ speed: event.currentTarget.value })}
        />
        {UNIT_SYSTEMS[unitSystem.value].speed.name}
      </label>
      {(texts.from !== "" || texts.speed !== "") && (
        <button type="button" class="icon-button" aria-label="Calm air" onClick={clearWind}>
          <Icon name="close" size={14} />
        </button>
      )}
      <small id="wind-note" class={error === "" ? "" : "field-wrong"}>
        {error || hint}
      </small>
    </div>
  );
}
