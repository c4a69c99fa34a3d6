import { useEffect, useLayoutEffect, useRef, useState } from "preact/hooks";
import type { QueuedTask, Task, TaskTerms } from "../../api/types";
import { TransientButton, useReturnFocus } from "../../ui/buttons";
import { NumberField } from "../../ui/fields";
import { tasksOnly } from "../offboard/capabilities";
import { engaged } from "../offboard/control-state";
import { type Refusal, RefusalNote } from "../offboard/refusal";
import { WING_RADIUS_M } from "./draft";
import { changeTask, taskRefusal } from "./task-draft";

interface Props {
  entry: QueuedTask;
  place: number;
  onClose: () => void;
}

/** The numbers of a task that waits, in its place in the list. What is refused stays as it was typed. */
export function TaskEdit({ entry: { id, task }, place, onClose }: Props) {
  const back = useReturnFocus<HTMLFormElement>();
  const first = useRef<HTMLDivElement>(null);
  const [form, setForm] = useState(() => editForm(task));
  const [wrong, setWrong] = useState<Readonly<Partial<Record<TaskEditField, string>>>>({});
  const [refusal, setRefusal] = useState<Refusal | null>(null);
  useEffect(() => first.current?.querySelector("input")?.focus(), []);
  useEscape(onClose);
  const isWing = tasksOnly.value;
  const faults = { ...missingFields(task, form), ...withoutEmpty(wrong) };
  const off = Object.keys(faults).length > 0;
  const field = (name: TaskEditField) => ({
    value: form[name],
    wrong: faults[name] ?? "",
    onType: (value: number | null, why: string) => {
      setForm((old) => ({ ...old, [name]: value }));
      setWrong((old) => ({ ...old, [name]: why }));
    },
  });

  async function save(): Promise<void> {
    if (off) return;
    const change = changedTerms(task, form);
    setRefusal(null);
    if (change === null || (await changeTask(id, place, change))) return onClose();
    if (back.current === null) return; // the lease ended and removed it: the panel says why
    setRefusal(taskRefusal.value);
    taskRefusal.value = null; // shown here, beside the fields
  }

  return (
    <form
      class="task-edit"
      ref={back}
      aria-label={`Edit task ${place + 1}`}
      noValidate
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
    >
      <div class="fields" ref={first}>
        <NumberField name="Duration" unit="s" empty="no limit" min={1} {...field("duration_s")} />
        {!isWing && <NumberField name="Speed" unit="m/s" empty="default" min={0.1} {...field("speed_m_s")} />}
        <NumberField
          name={form.above === "home" ? "Height above home" : "Height AMSL"}
          unit="m"
          empty="current"
          {...field("altitude_m")}
        />
        {task.type === "circle" && (
          <NumberField
            name="Radius"
            unit="m"
            empty="required"
            min={isWing ? WING_RADIUS_M.least : 1}
            {...field("radius_m")}
          />
        )}
      </div>
      {refusal !== null && <RefusalNote refusal={refusal} />}
      <div class="actions">
        <button type="submit" class="small" aria-disabled={off || undefined}>
          Save
        </button>
        <TransientButton name="Cancel" onClick={onClose} />
      </div>
    </form>
  );
}

function withoutEmpty(wrong: Readonly<Partial<Record<TaskEditField, string>>>): Partial<Record<TaskEditField, string>> {
  return Object.fromEntries(Object.entries(wrong).filter(([, why]) => why !== ""));
}

/** Under control Escape leaves to Hold, as everywhere on the page, and closes nothing. */
function useEscape(onClose: () => void): void {
  const close = useRef(onClose);
  useLayoutEffect(() => {
    close.current = onClose;
  });
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => event.key === "Escape" && !engaged.value && close.current();
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}

// The form of a waiting task, and what was changed in it

/** `above`: what the height counts from. `radius_m` is of a circle, without its direction. */
interface TaskEditForm {
  readonly duration_s: number | null;
  readonly speed_m_s: number | null;
  readonly above: "home" | "sea";
  readonly altitude_m: number | null;
  readonly radius_m: number | null;
}

type TaskEditField = Exclude<keyof TaskEditForm, "above">;

export function editForm(task: Task): TaskEditForm {
  const above = task.absolute_altitude_m === null ? "home" : "sea";
  return {
    duration_s: task.duration_s > 0 ? task.duration_s : null,
    speed_m_s: task.speed_m_s,
    above,
    altitude_m: above === "home" ? task.relative_altitude_m : task.absolute_altitude_m,
    radius_m: task.type === "circle" ? Math.abs(task.radius_m) : null,
  };
}

/** The terms that the form changes; null if it changes none. */
export function changedTerms(task: Task, form: TaskEditForm): TaskTerms | null {
  const was = editForm(task);
  const terms: TaskTerms = {};
  if (form.duration_s !== was.duration_s) terms.duration_s = form.duration_s ?? -1;
  if (form.speed_m_s !== was.speed_m_s) terms.speed_m_s = form.speed_m_s;
  if (form.altitude_m !== was.altitude_m)
    terms[was.above === "home" ? "relative_altitude_m" : "absolute_altitude_m"] = form.altitude_m;
  if (task.type === "circle" && form.radius_m !== null && form.radius_m !== was.radius_m)
    terms.radius_m = Math.sign(task.radius_m) * form.radius_m;
  return Object.keys(terms).length === 0 ? null : terms;
}

/** What is missing, by field. */
export function missingFields(task: Task, form: TaskEditForm): Readonly<Partial<Record<TaskEditField, string>>> {
  return task.type === "circle" && form.radius_m === null ? { radius_m: "required" } : {};
}

/** A task can be edited until it is flown; the first one only while the vehicle is not under control yet. */
export function canEditTask(tasks: readonly QueuedTask[], id: string, isLeasedOnly: boolean): boolean {
  const place = tasks.findIndex((entry) => entry.id === id);
  return place > 0 || (place === 0 && isLeasedOnly);
}
