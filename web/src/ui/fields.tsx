import type { ComponentChildren } from "preact";

import { inPageUnits } from "../format/units";

interface ChoiceProps {
  name: string;
  value: string;
  onChange: (value: string) => void;
  children: ComponentChildren;
}

/** One of several, as a field. */
export function SelectField({ name, value, onChange, children }: ChoiceProps) {
  return (
    <label class="field">
      <span>{name}</span>
      <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        {children}
      </select>
    </label>
  );
}

interface NumberProps {
  name: string;
  unit: "m" | "m/s" | "s";
  value: number | null;
  /** What is wrong with what stands in it, in words; empty: nothing. */
  wrong: string;
  /** What an empty field means. */
  empty: string;
  min?: number | undefined;
  onType: (value: number | null, wrong: string) => void;
}

/**
 * A number of a task. Beside its name the number in the units of the page, if these are others, or what is wrong with
 * it.
 */
export function NumberField({ name, unit, value, wrong, empty, min, onType }: NumberProps) {
  const words = inPageUnits(unit, value);
  return (
    <label class="field">
      <span>
        {name} ({unit})
        {wrong !== "" ? (
          <small class="field-wrong"> {wrong}</small>
        ) : (
          words !== "" && <small class="besides"> = {words}</small>
        )}
      </span>
      <input
        type="number"
        step="any"
        min={min}
        inputMode="decimal"
        placeholder={empty}
        value={value ?? ""}
        aria-invalid={wrong !== ""}
        onInput={(event) => onType(...readNumber(event.currentTarget, min))}
      />
    </label>
  );
}

/** What a number field of the page says of what is typed in it. */
interface TypedNumber {
  readonly valueAsNumber: number;
  readonly validity: { readonly valid: boolean; readonly badInput: boolean };
}

/** The number, null if nothing is typed, and what is wrong with it, in words; empty: nothing. */
export function readNumber(
  { valueAsNumber, validity }: TypedNumber,
  least?: number,
): readonly [value: number | null, wrong: string] {
  const wrong = validity.badInput ? "not a number" : validity.valid ? "" : `at least ${least}`;
  return [Number.isNaN(valueAsNumber) ? null : valueAsNumber, wrong];
}
