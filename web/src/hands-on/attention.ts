/** Whether somebody is at the controls: page visible, window focused, focus within the controls or on the map. */

import type { StopReason } from "./sender";

/** What may have the focus while a vehicle is flown. */
const WITHIN = ".offboard, .map";

/** Null: somebody is there. */
export function whyUnattended(): StopReason | null {
  if (document.hidden) return "hidden";
  if (!document.hasFocus()) return "window_left";
  return document.activeElement?.closest(WITHIN) ? null : "focus_left";
}

/** Somebody looks at the page, whatever part of it. */
export function isPresent(): boolean {
  return !document.hidden && document.hasFocus();
}

/** Tells every loss as it happens. Returns how to stop. */
export function watchAttention(onLost: (reason: StopReason) => void): () => void {
  const events = new AbortController();
  const options = { signal: events.signal };
  window.addEventListener("blur", () => onLost("window_left"), options);
  window.addEventListener("pagehide", () => onLost("page_closed"), options);
  document.addEventListener("freeze", () => onLost("hidden"), options);
  document.addEventListener("visibilitychange", () => document.hidden && onLost("hidden"), options);
  document.addEventListener(
    "focusin",
    ({ target }) => {
      if (target instanceof Element && target.closest(WITHIN) === null) onLost("focus_left");
    },
    options,
  );
  return () => events.abort();
}
