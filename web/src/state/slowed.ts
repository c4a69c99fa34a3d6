/** A signal that follows another one, but changes no more often than it is looked at. */

import { effect, signal, type ReadonlySignal } from "@preact/signals";

/** The first change at once, then the newest one each `every_ms`. Lasts as long as the page. */
export function slowed<T>(source: ReadonlySignal<T>, every_ms: number): ReadonlySignal<T> {
  const shown = signal(source.peek());
  let waits = false;
  const show = () => {
    waits = source.peek() !== shown.peek();
    if (!waits) return;
    shown.value = source.peek();
    setTimeout(show, every_ms);
  };
  effect(() => {
    void source.value;
    if (!waits) show();
  });
  return shown;
}
