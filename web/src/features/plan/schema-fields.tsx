import { useState } from "preact/hooks";
import { humanize } from "../../format/text";
import { inPageUnits } from "../../format/units";
import { Icon } from "../../ui/icons";
import type { Field } from "../../ui/schema-control";
import { findingPointers } from "./draft";
import { editPlan } from "./draft-text";
import { isRecord, withValue } from "./pointer";

interface Props {
  fields: readonly Field[];
  /** Where in the plan the object is that has these fields. */
  pointer: string;
  value: unknown;
}

/** The fields of one object of the plan: those it must have or has, and the others on request. */
export function SchemaFields({ fields, pointer, value }: Props) {
  const record = isRecord(value) ? value : {};
  const given = (field: Field) =>
    field.required || (record[field.name] ?? null) !== null || findingPointers.value.has(`${pointer}/${field.name}`);
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set()); // one that is emptied again stays where it was
  const shown = fields.filter((field) => given(field) || open.has(field.name));
  const others = fields.filter((field) => !shown.includes(field));
  const show = (name: string) => {
    setOpen(new Set([...open, name, ...shown.map((field) => field.name)]));
    const isObject = fields.find((field) => field.name === name)?.control.kind === "object";
    if (isObject) editPlan((plan) => withValue(plan, `${pointer}/${name}`, {})); // its fields can be chosen at once
  };
  return (
    <div class="fields">
      {shown.map((field) => (
        <SchemaField
          key={field.name}
          field={field}
          pointer={`${pointer}/${field.name}`}
          value={record[field.name] ?? undefined}
        />
      ))}
      {others.length > 0 && (
        <select
          class="small field-more"
          aria-label="Add a field"
          value=""
          onChange={(event) => show(event.currentTarget.value)}
        >
          <option value="">Add a field…</option>
          {others.map((field) => (
            <option key={field.name} value={field.name}>
              {field.label}
              {field.unit === "" ? "" : ` (${field.unit})`}
            </option>
          ))}
        </select>
      )}
    </div>
  );
}

interface FieldProps {
  field: Field;
  pointer: string;
  value: unknown;
}

function SchemaField({ field, pointer, value }: FieldProps) {
  const { control } = field;
  const write = (next: unknown) => editPlan((plan) => withValue(plan, pointer, next), pointer);
  if (control.kind === "object") return <ObjectField field={field} pointer={pointer} value={value} onChange={write} />;
  return (
    // biome-ignore lint/a11y/noLabelWithoutControl: the control is the component in it
    <label class="field" title={field.help || undefined}>
      <span>
        {field.label}
        {field.unit !== "" && <small> ({field.unit})</small>}
        <Besides field={field} value={value} />
      </span>
      <ValueControl field={field} wrong={findingPointers.value.has(pointer)} value={value} onChange={write} />
    </label>
  );
}

interface ValueProps {
  field: Field;
  wrong: boolean;
  value: unknown;
  onChange: (value: unknown) => void;
}

function ValueControl({ field, wrong, value, onChange }: ValueProps) {
  const { control, fallback } = field;
  const text = typeof value === "string" ? value : "";
  if (control.kind === "choice")
    return <ChoiceInput field={field} options={control.options} wrong={wrong} text={text} onChange={onChange} />;
  const placeholder = String(fallback ?? "");
  if (control.kind === "number")
    return (
      <NumberInput value={value} wrong={wrong} placeholder={placeholder} title={control.range} onChange={onChange} />
    );
  return (
    <input
      type="text"
      autocomplete="off"
      value={text}
      aria-invalid={wrong}
      placeholder={placeholder}
      onInput={(event) => onChange(event.currentTarget.value || undefined)}
    />
  );
}

interface ChoiceProps extends Omit<ValueProps, "value"> {
  options: readonly string[];
  text: string;
}

function ChoiceInput({ field: { required, fallback }, options, wrong, text, onChange }: ChoiceProps) {
  return (
    <select value={text} aria-invalid={wrong} onChange={(event) => onChange(event.currentTarget.value || undefined)}>
      {(!required || text === "") && (
        <option value="">{fallback === undefined ? "–" : `${humanize(String(fallback))} (default)`}</option>
      )}
      {options.map((option) => (
        <option key={option} value={option}>
          {humanize(option)}
        </option>
      ))}
    </select>
  );
}

/** The plan's number in the units of the page, if these are others. */
function Besides({ field, value }: { field: Field; value: unknown }) {
  const words = inPageUnits(field.unit, value ?? field.fallback);
  return words === "" ? null : <small class="besides"> = {words}</small>;
}

interface NumberProps {
  value: unknown;
  wrong: boolean;
  placeholder: string;
  title: string;
  onChange: (value: number | undefined) => void;
}

/** While somebody types, the text is theirs ("1.", "-"); every number that it makes on the way is the plan's. */
function NumberInput({ value, wrong, placeholder, title, onChange }: NumberProps) {
  const [typed, setTyped] = useState<string | null>(null);
  const number = (text: string) => (text.trim() === "" ? undefined : Number(text.trim().replace(",", ".")));
  const unread = typed !== null && Number.isNaN(number(typed));
  const write = (text: string) => {
    setTyped(text);
    const next = number(text);
    if (next === undefined || Number.isFinite(next)) onChange(next);
  };
  return (
    <input
      type="text"
      inputMode="decimal"
      autocomplete="off"
      title={title}
      placeholder={placeholder}
      value={typed ?? (value === undefined ? "" : String(value))}
      aria-invalid={wrong || unread}
      onInput={(event) => write(event.currentTarget.value)}
      onBlur={() => setTyped(null)}
    />
  );
}

interface ObjectProps extends FieldProps {
  onChange: (value: unknown) => void;
}

/** An object in the object: there or not. */
function ObjectField({ field, pointer, value, onChange }: ObjectProps) {
  if (field.control.kind !== "object") return null;
  return (
    <fieldset class="field-group">
      <legend>{field.label}</legend>
      {value === undefined ? (
        <button type="button" class="small" onClick={() => onChange({})}>
          <Icon name="plus" size={14} />
          Add {field.label.toLowerCase()}
        </button>
      ) : (
        <>
          <SchemaFields fields={field.control.fields} pointer={pointer} value={value} />
          <button
            type="button"
            class="icon-button group-remove"
            aria-label={`Remove ${field.label.toLowerCase()}`}
            onClick={() => onChange(undefined)}
          >
            <Icon name="close" size={14} />
          </button>
        </>
      )}
    </fieldset>
  );
}
