import { goToArmed } from "../state/controls";
import { controlledVehicle } from "../state/hands-on";
import { PassingButton } from "./passing-button";

/** On the map: what the next click does. */
export function GoToHint() {
  if (!goToArmed.value) return null;
  return (
    <div class="map-edit">
      <p class="map-hint" role="status">
        <span>Click where {controlledVehicle.value?.id ?? "it"} shall go, at its own speed and the altitude of now.</span>
        <PassingButton name="Cancel" onClick={() => (goToArmed.value = false)} />
      </p>
    </div>
  );
}
