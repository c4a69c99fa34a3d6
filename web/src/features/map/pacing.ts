/**
 * How often telemetry may draw the map anew: where it is drawn in software, most of the time is left for all the rest.
 */

/** Frames of the screen until new data is surely drawn: data, worker, drawing. */
export const FRAMES_UNTIL_DRAWN = 3;
/** So many frames within this need no rest. */
const CHEAP_MS = 100;
/** Of a slow map's time, rest to drawing. */
const REST = 4;
const LONGEST_REST_MS = 3000;
/** A map that is hidden is not drawn, and does not say so. */
const UNDRAWN_MS = 2000;

export function restAfterDraw(cost_ms: number): number {
  return cost_ms <= CHEAP_MS ? 0 : Math.min(LONGEST_REST_MS, REST * cost_ms);
}

export class RedrawThrottle {
  #timer: ReturnType<typeof setTimeout> | undefined;
  #began: number | null = null;

  /** `onRested` is called when what waited may be drawn. */
  constructor(private readonly onRested: () => void) {}

  /** While it is drawn, and after it. */
  get rests(): boolean {
    return this.#timer !== undefined;
  }

  begin(now: number): void {
    if (this.rests) return;
    this.#began = now;
    this.#rest(UNDRAWN_MS);
  }

  /** It is on the screen. */
  drawn(now: number): void {
    if (this.#began === null) return;
    const cost_ms = now - this.#began;
    this.#began = null;
    this.#rest(restAfterDraw(cost_ms));
  }

  end(): void {
    clearTimeout(this.#timer);
  }

  #rest(rest_ms: number): void {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#timer = undefined;
      this.#began = null;
      this.onRested();
    }, rest_ms);
  }
}
