import { useEffect } from "preact/hooks";
import { viewCentre } from "../map/camera";
import { goToArmed } from "../state/controls";
import { goThere } from "../state/hands-session";

/** On the map with the go-to tool in hand: Space or Enter goes to its middle. Escape leaves to Hold, as everywhere. */
export function useGoToKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (!goToArmed.value || !(event.target instanceof Element) || event.target.closest(".map-canvas") === null) return;
      if ((event.key !== " " && event.key !== "Enter") || event.repeat) return;
      goThere(viewCentre.value);
      event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
