import { useId, useState } from "preact/hooks";
import type { FaultKind } from "../../api/types";
import { capitalize, humanize } from "../../format/text";
import { hasRole } from "../../store/principal";
import { live } from "../../store/store";
import { type Control, controlOf } from "../../ui/schema-control";
import { clearingValue, faultLabel, faultUnit, formatFaultValue, parseFaultValue } from "./faults";
import { dismissFaultProblem, faultProblems, setFault, settingFault } from "./simulator";

interface Props {
  kind: FaultKind;
  /** Null: all simulated vehicles. */
  target: string | null;
  /** Its value now, if it lasts; undefined without it. */
  current: unknown;
}

/** One fault: what it does, and the control that its value's schema asks for. */
export function FaultRow({ kind, target, current }: Props) {
  const id = useId();
  const [problem, setProblem] = useState("");
  const control = controlOf(kind.value_schema);
  const send = (value: unknown) => {
    setProblem("");
    void setFault(target, kind.fault, value);
  };
  const disabled = !live.value || !hasRole("pilot") || settingFault.value === kind.fault;
  const clear = clearingValue(kind);
  return (
    <li class={`fault${current === undefined ? "" : " set"}`} data-fault={kind.fault}>
      <div class="fault-text">
        <b id={`${id}-name`}>{faultLabel(kind.fault)}</b>
        <small id={`${id}-effect`}>{capitalize(kind.effect)}</small>
      </div>
      {control.kind === "switch" ? (
        <button
          type="button"
          class="switch"
          role="switch"
          aria-checked={current === true}
          aria-labelledby={`${id}-name`}
          aria-describedby={`${id}-effect`}
          disabled={disabled}
          onClick={() => send(current !== true)}
        />
      ) : (
        <ValueForm
          id={id}
          kind={kind}
          control={control}
          current={current}
          disabled={disabled}
          onSend={send}
          onProblem={setProblem}
        />
      )}
      {current !== undefined && control.kind !== "switch" && (
        <p class="fault-now">
          Now {formatFaultValue(current)} {faultUnit(kind)}
          {clear !== undefined && (
            <button
              type="button"
              class="small"
              aria-label={`Clear ${faultLabel(kind.fault)}`}
              disabled={disabled}
              onClick={() => send(clear)}
            >
              Clear
            </button>
          )}
        </p>
      )}
      <FaultProblem fault={kind.fault} typed={problem} />
    </li>
  );
}

interface FormProps {
  id: string;
  kind: FaultKind;
  control: Control;
  current: unknown;
  disabled: boolean;
  onSend: (value: unknown) => void;
  onProblem: (words: string) => void;
}

function ValueForm({ id, kind, control, current, disabled, onSend, onProblem }: FormProps) {
  const [texts, setTexts] = useState<readonly string[]>(() => startTexts(current));
  const name = faultLabel(kind.fault);
  const verb = control.kind === "once" ? "Apply" : "Set";
  const write = (i: number, text: string) => setTexts(Object.assign([...texts], { [i]: text }));
  const submit = (event: Event) => {
    event.preventDefault();
    const typed = parseFaultValue(control, texts);
    if ("error" in typed) onProblem(typed.error);
    else onSend(typed.value);
  };
  return (
    <form class="fault-form" onSubmit={submit}>
      {control.kind === "choice" && (
        <select
          aria-label={name}
          aria-describedby={`${id}-effect`}
          disabled={disabled}
          value={texts[0] ?? ""}
          onChange={(event) => write(0, event.currentTarget.value)}
        >
          <option value="">Select…</option>
          {control.options.map((option) => (
            <option key={option} value={option}>
              {option === option.toUpperCase() ? option : humanize(option)}
            </option>
          ))}
        </select>
      )}
      {numbersOf(control).map(({ part, range }, i) => (
        <label key={part} class="number-unit">
          <span class={part === "" ? "visually-hidden" : ""}>{part === "" ? name : humanize(part)}</span>
          <input
            type="text"
            inputMode="decimal"
            autocomplete="off"
            size={control.kind === "tuple" ? 3 : 5}
            placeholder={range}
            title={range}
            disabled={disabled}
            value={texts[i] ?? ""}
            onInput={(event) => write(i, event.currentTarget.value)}
          />
        </label>
      ))}
      {numbersOf(control).length > 0 && <small>{faultUnit(kind)}</small>}
      <button type="submit" class="small" aria-label={`${verb} ${name}`} disabled={disabled}>
        {verb}
      </button>
    </form>
  );
}

function numbersOf(control: Control): { part: string; range: string }[] {
  if (control.kind === "number") return [{ part: "", range: control.range }];
  if (control.kind !== "tuple") return [];
  return control.parts.map((part, i) => ({
    part: control.names[i] ?? "",
    range: part.kind === "number" ? part.range : "",
  }));
}

function startTexts(current: unknown): readonly string[] {
  if (current === undefined) return [];
  return Array.isArray(current) ? current.map(String) : [String(current)];
}

/** Why a fault or the speed was not set: what was typed is no value, or the service said no. */
export function FaultProblem({ fault, typed = "" }: { fault: string; typed?: string }) {
  const refused = faultProblems.value[fault];
  if (typed === "" && refused === undefined) return null;
  const words =
    refused === undefined
      ? ""
      : [
          refused.title,
          ...(refused.findings.length > 0 ? refused.findings.map((finding) => finding.message) : [refused.detail]),
          refused.hint,
        ]
          .filter((part) => part !== "")
          .map(capitalize)
          .join(". ");
  return (
    <p class="form-problem" role="alert">
      {typed || words}
      {refused !== undefined && (
        <button type="button" class="small" onClick={() => dismissFaultProblem(fault)}>
          Dismiss
        </button>
      )}
    </p>
  );
}
