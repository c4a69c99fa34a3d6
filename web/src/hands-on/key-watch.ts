/** Keys that are let go, and Escape, wherever on the page: the focus may have moved while a key was down. */

export interface KeyWatcher {
  onRelease(code: string): void;
  onEscape(): void;
}

/** `page`: the window. It hears them on their way down, before any tool can keep one. Returns how to stop. */
export function watchKeys(page: EventTarget, { onRelease, onEscape }: KeyWatcher): () => void {
  const events = new AbortController();
  const options = { capture: true, signal: events.signal };
  page.addEventListener("keyup", (event) => onRelease((event as KeyboardEvent).code), options);
  page.addEventListener("keydown", (event) => isEscape(event as KeyboardEvent) && onEscape(), options);
  return () => events.abort();
}

function isEscape({ code, repeat }: KeyboardEvent): boolean {
  return code === "Escape" && !repeat;
}
