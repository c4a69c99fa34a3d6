import type { ComponentChildren } from "preact";

interface Props {
  name: string;
  value: string;
  onChange: (value: string) => void;
  children: ComponentChildren;
}

/** One of several, as a field. */
export function Choice({ name, value, onChange, children }: Props) {
  return (
    <label class="field">
      <span>{name}</span>
      <select value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        {children}
      </select>
    </label>
  );
}
