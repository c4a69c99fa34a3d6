import { useLayoutEffect, useRef } from "preact/hooks";
import type { RefObject } from "preact";

/**
 * For a button at the controls that goes away, often by its own press: the panel takes its focus over before it is gone.
 * Else nothing would have the focus, which counts as nobody at the controls.
 */
export function useFocusBack(): RefObject<HTMLButtonElement | null> {
  const ref = useRef<HTMLButtonElement>(null);
  useLayoutEffect(() => {
    const button = ref.current;
    return () => {
      if (button === null || button !== document.activeElement || button.closest(".hands-on, .map") === null) return;
      document.querySelector<HTMLElement>(".hands-on")?.focus({ preventScroll: true });
    };
  }, []);
  return ref;
}
