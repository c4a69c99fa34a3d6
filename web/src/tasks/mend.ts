/** A task that waits for its turn, mended: its numbers as a form, and what of them was changed. Pure. */

import type { QueuedTask, Task, TaskTerms } from "../api/types";

/** `above`: what the height counts from. `radius_m` is of a circle, without its direction. */
export interface MendForm {
  readonly duration_s: number | null;
  readonly speed_m_s: number | null;
  readonly above: "home" | "sea";
  readonly altitude_m: number | null;
  readonly radius_m: number | null;
}

export type MendField = Exclude<keyof MendForm, "above">;

export function mendForm(task: Task): MendForm {
  const above = task.absolute_altitude_m === null ? "home" : "sea";
  return {
    duration_s: task.duration_s > 0 ? task.duration_s : null,
    speed_m_s: task.speed_m_s,
    above,
    altitude_m: above === "home" ? task.relative_altitude_m : task.absolute_altitude_m,
    radius_m: task.type === "circle" ? Math.abs(task.radius_m) : null,
  };
}

/** What is said of the task anew; null: it is as it was. */
export function termsOf(task: Task, form: MendForm): TaskTerms | null {
  const was = mendForm(task);
  const terms: TaskTerms = {};
  if (form.duration_s !== was.duration_s) terms.duration_s = form.duration_s ?? -1;
  if (form.speed_m_s !== was.speed_m_s) terms.speed_m_s = form.speed_m_s;
  if (form.altitude_m !== was.altitude_m) terms[was.above === "home" ? "relative_altitude_m" : "absolute_altitude_m"] = form.altitude_m;
  if (task.type === "circle" && form.radius_m !== null && form.radius_m !== was.radius_m) terms.radius_m = Math.sign(task.radius_m) * form.radius_m;
  return Object.keys(terms).length === 0 ? null : terms;
}

/** What is missing, by field. */
export function missing(task: Task, form: MendForm): Readonly<Partial<Record<MendField, string>>> {
  return task.type === "circle" && form.radius_m === null ? { radius_m: "needed" } : {};
}

/** Tasks are mended until they are flown: the first one while the vehicle is not under control yet. */
export function mayBeMended(tasks: readonly QueuedTask[], id: string, isLeasedOnly: boolean): boolean {
  const place = tasks.findIndex((entry) => entry.id === id);
  return place > 0 || (place === 0 && isLeasedOnly);
}
