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
