/** What is carried while a task is dragged. Ids are a vehicle's own: another one has a t1 too, in another window. Pure. */

/** Not a plain text, so that nothing else on the page or the desk takes it. */
export const DRAGGED = "application/x-waydrop-task";

export interface Dragged {
  readonly vehicle: string;
  readonly task_id: string;
}

export const draggedText = (dragged: Dragged): string => JSON.stringify(dragged);

/** Null for what no page of this version wrote. */
export function draggedTask(text: string): Dragged | null {
  let doc: unknown;
  try {
    doc = JSON.parse(text);
  } catch {
    return null;
  }
  const { vehicle, task_id } = Object(doc) as Partial<Record<keyof Dragged, unknown>>;
  return typeof vehicle === "string" && typeof task_id === "string" ? { vehicle, task_id } : null;
}
