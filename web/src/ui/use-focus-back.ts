import { useLayoutEffect, useRef } from "preact/hooks";
import type { RefObject } from "preact";

/**
 * For a button at the controls that goes away, often by its own press, or a form with its fields: the panel takes its focus over before it is gone.
 * Else nothing would have the focus, which counts as nobody at the controls.
 */
export function useFocusBack<Part extends HTMLElement = HTMLButtonElement>(): RefObject<Part | null> {
  const ref = useRef<Part>(null);
  useLayoutEffect(() => {
    const part = ref.current;
    return () => {
      if (part === null || !part.contains(document.activeElement) || part.closest(".offboard, .map") === null) return;
      document.querySelector<HTMLElement>(".offboard")?.focus({ preventScroll: true });
    };
  }, []);
  return ref;
}
