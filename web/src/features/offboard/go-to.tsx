import { useEffect } from "preact/hooks";
import { viewCentre } from "../../store/map-view";
import { PassingButton } from "../../ui/buttons";
import { goThere } from "./control-session";
import { controlledVehicle, goToArmed } from "./control-state";

/** On the map: what the next click does. */
export function GoToHint() {
  if (!goToArmed.value) return null;
  return (
    <div class="map-edit">
      <p class="map-hint" role="status">
        <span>
          Click where {controlledVehicle.value?.id ?? "it"} shall go, at its own speed and the altitude of now.
        </span>
        <PassingButton name="Cancel" onClick={() => (goToArmed.value = false)} />
      </p>
    </div>
  );
}

/** On the map with the go-to tool in hand: Space or Enter goes to its middle. Escape leaves to Hold, as everywhere. */
export function useGoToKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (!goToArmed.value || !(event.target instanceof Element) || event.target.closest(".map-canvas") === null)
        return;
      if ((event.key !== " " && event.key !== "Enter") || event.repeat) return;
      goThere(viewCentre.value);
      event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
