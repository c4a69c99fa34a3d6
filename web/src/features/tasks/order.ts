/** Where in the queue a task goes, said as the service takes it: before which other task. Pure. */

export interface Move {
  readonly task_id: string;
  /** The task before which it then stands; null: last. */
  readonly before: string | null;
}

/**
 * The move that gives a task the place of another one. By their ids: the current task may end while somebody drags, and
 * each has another place then. Null: there is none.
 */
export function moveOnto(ids: readonly string[], task_id: string, onto: string): Move | null {
  const [from, to] = [ids.indexOf(task_id), ids.indexOf(onto)];
  if (from < 0 || to < 0 || from === to) return null;
  return { task_id, before: ids.toSpliced(from, 1)[to] ?? null };
}

// What is carried while a task is dragged. Ids are a vehicle's own: another one has a t1 too, in another window. Pure.

/** Not a plain text, so that nothing else on the page or the desk takes it. */
export const TASK_DRAG_TYPE = "application/x-waydrop-task";

interface DraggedTask {
  readonly vehicle: string;
  readonly task_id: string;
}

export const encodeDrag = (dragged: DraggedTask): string => JSON.stringify(dragged);

/** Null for what no page of this version wrote. */
export function decodeDrag(text: string): DraggedTask | null {
  let doc: unknown;
  try {
    doc = JSON.parse(text);
  } catch {
    return null;
  }
  const { vehicle, task_id } = Object(doc) as Partial<Record<keyof DraggedTask, unknown>>;
  return typeof vehicle === "string" && typeof task_id === "string" ? { vehicle, task_id } : null;
}
