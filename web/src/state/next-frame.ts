/** Does something once with the screen's next frame, however often it is asked for. */

/** A hidden page has no frames, and a busy one few: then it is done after so long. */
const LATEST_MS = 250;

export class NextFrame {
  #frame = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly run: () => void) {}

  ask(): void {
    if (this.#timer !== undefined) return;
    this.#timer = setTimeout(() => this.now(), LATEST_MS);
    this.#frame = requestAnimationFrame(() => this.now());
  }

  /** At once, and not again for what was asked before. */
  now(): void {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    cancelAnimationFrame(this.#frame);
    this.run();
  }
}
