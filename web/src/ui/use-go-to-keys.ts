import { useEffect } from "preact/hooks";
import { viewCentre } from "../map/camera";
import { goToArmed } from "../state/controls";
import { goThere } from "../state/hands-session";

/** On the map with the go-to tool in hand: Space or Enter goes to its middle, Escape puts the tool away. */
export function useGoToKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (!goToArmed.value || !(event.target instanceof Element) || event.target.closest(".map-canvas") === null) return;
      if (event.key === "Escape") goToArmed.value = false;
      else if ((event.key === " " || event.key === "Enter") && !event.repeat) goThere(viewCentre.value);
      else return;
      event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
