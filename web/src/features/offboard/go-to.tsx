import { useEffect } from "preact/hooks";
import { mapCentre } from "../../store/map-view";
import { TransientButton } from "../../ui/buttons";
import { goToPoint } from "./control-session";
import { controlledVehicle, goToArmed } from "./control-state";

/** On the map: what the next click does. */
export function GoToHint() {
  if (!goToArmed.value) return null;
  return (
    <div class="map-edit">
      <p class="map-hint" role="status">
        <span>
          Click where {controlledVehicle.value?.id ?? "it"} should go. It keeps its altitude and flies at its own speed.
        </span>
        <TransientButton name="Cancel" onClick={() => (goToArmed.value = false)} />
      </p>
    </div>
  );
}

/** On the map with the go-to tool: Space or Enter goes to its centre. Escape exits to Hold, as everywhere. */
export function useGoToKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (!goToArmed.value || !(event.target instanceof Element) || event.target.closest(".map-canvas") === null)
        return;
      if ((event.key !== " " && event.key !== "Enter") || event.repeat) return;
      goToPoint(mapCentre.value);
      event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}
