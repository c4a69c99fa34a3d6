import { type ReadonlySignal, useComputed } from "@preact/signals";

/**
 * A computed value that counts as changed only if it says something else: telemetry brings the same again and again.
 */
export function useStableComputed<T>(compute: () => T): ReadonlySignal<T> {
  const text = useComputed(() => JSON.stringify(compute()));
  return useComputed(() => JSON.parse(text.value) as T);
}
