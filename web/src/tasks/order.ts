/** Where in the queue a task goes, said as the service takes it: before which other task. Pure. */

/** The task before which it then stands, null: last. `from` and `to` are places in the list, current first. */
export function beforeOf(ids: readonly string[], from: number, to: number): string | null {
  const rest = ids.toSpliced(from, 1);
  return rest[to] ?? null;
}
