import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import type { QueuedTask } from "../api/types";
import type { Refusal } from "../hands-on/refusal";
import { engaged } from "../state/hands-on";
import { tasksOnly } from "../state/offboard-facts";
import { changeTask, taskRefusal } from "../state/task-draft";
import { WING_RADIUS_M } from "../tasks/draft";
import { mendForm, missing, termsOf, type MendField } from "../tasks/mend";
import { NumberField } from "./number-field";
import { PassingButton } from "./passing-button";
import { RefusalNote } from "./refusal-note";
import { useFocusBack } from "./use-focus-back";

interface Props {
  entry: QueuedTask;
  place: number;
  onClose: () => void;
}

/** The numbers of a task that waits, in its place in the list. What is refused stays as it was typed. */
export function TaskMend({ entry: { id, task }, place, onClose }: Props) {
  const back = useFocusBack<HTMLFormElement>();
  const first = useRef<HTMLDivElement>(null);
  const [form, setForm] = useState(() => mendForm(task));
  const [wrong, setWrong] = useState<Readonly<Partial<Record<MendField, string>>>>({});
  const [refusal, setRefusal] = useState<Refusal | null>(null);
  useEffect(() => first.current?.querySelector("input")?.focus(), []);
  useEscape(onClose);
  const isWing = tasksOnly.value;
  const faults = { ...missing(task, form), ...withoutEmpty(wrong) };
  const off = Object.keys(faults).length > 0;
  const field = (name: MendField) => ({
    value: form[name],
    wrong: faults[name] ?? "",
    onType: (value: number | null, why: string) => {
      setForm((old) => ({ ...old, [name]: value }));
      setWrong((old) => ({ ...old, [name]: why }));
    },
  });

  async function save(): Promise<void> {
    if (off) return;
    const change = termsOf(task, form);
    setRefusal(null);
    if (change === null || (await changeTask(id, place, change))) return onClose();
    if (back.current === null) return; // it is gone, with the lease: the panel tells why
    setRefusal(taskRefusal.value);
    taskRefusal.value = null; // told here, beside what is to be mended
  }

  return (
    <form
      class="task-mend"
      ref={back}
      aria-label={`Change task ${place + 1}`}
      noValidate
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
    >
      <div class="fields" ref={first}>
        <NumberField name="Duration" unit="s" empty="no limit" min={1} {...field("duration_s")} />
        {!isWing && <NumberField name="Speed" unit="m/s" empty="its own" min={0.1} {...field("speed_m_s")} />}
        <NumberField name={form.above === "home" ? "Height above home" : "Height AMSL"} unit="m" empty="as it is" {...field("altitude_m")} />
        {task.type === "circle" && <NumberField name="Radius" unit="m" empty="needed" min={isWing ? WING_RADIUS_M.least : 1} {...field("radius_m")} />}
      </div>
      {refusal !== null && <RefusalNote refusal={refusal} />}
      <div class="actions">
        <button type="submit" class="primary" aria-disabled={off || undefined}>
          Save
        </button>
        <PassingButton name="Cancel" onClick={onClose} />
      </div>
    </form>
  );
}

function withoutEmpty(wrong: Readonly<Partial<Record<MendField, string>>>): Partial<Record<MendField, string>> {
  return Object.fromEntries(Object.entries(wrong).filter(([, why]) => why !== ""));
}

/** Under control Escape leaves to Hold, as everywhere on the page, and closes nothing. */
function useEscape(onClose: () => void): void {
  const close = useRef(onClose);
  useLayoutEffect(() => void (close.current = onClose));
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => event.key === "Escape" && !engaged.value && close.current();
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
