/** Does something once with the screen's next frame, however often it is asked for. */

import { effect, type ReadonlySignal, signal } from "@preact/signals";

/** A hidden page has no frames, and a busy one few: then it is done after so long. */
const LATEST_MS = 250;

export class NextFrame {
  #frame = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly run: () => void) {}

  request(): void {
    if (this.#timer !== undefined) return;
    this.#timer = setTimeout(() => this.now(), LATEST_MS);
    this.#frame = requestAnimationFrame(() => this.now());
  }

  /** At once, and not again for what was asked before. */
  now(): void {
    if (this.#timer !== undefined) {
      clearTimeout(this.#timer);
      this.#timer = undefined;
      cancelAnimationFrame(this.#frame);
    }
    this.run();
  }
}

// A signal that follows another one, but changes no more often than it is looked at.

/** The first change at once, then the newest one each `every_ms`. Lasts as long as the page. */
export function throttled<T>(source: ReadonlySignal<T>, every_ms: number): ReadonlySignal<T> {
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
