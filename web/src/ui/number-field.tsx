import { besides } from "../format/units";
import { readTyped } from "../tasks/draft";

interface Props {
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

/** A number of a task. Beside its name the number in the units of the page, if these are others, or what is wrong with it. */
export function NumberField({ name, unit, value, wrong, empty, min, onType }: Props) {
  const words = besides(unit, value);
  return (
    <label class="field">
      <span>
        {name} ({unit})
        {wrong !== "" ? <small class="field-wrong"> {wrong}</small> : words !== "" && <small class="besides"> = {words}</small>}
      </span>
      <input type="number" step="any" min={min} inputMode="decimal" placeholder={empty} value={value ?? ""} aria-invalid={wrong !== ""} onInput={(event) => onType(...readTyped(event.currentTarget, min))} />
    </label>
  );
}
