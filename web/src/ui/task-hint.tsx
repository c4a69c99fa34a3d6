import { controlledVehicle } from "../state/hands-on";
import { taskKind } from "../state/task-draft";
import { AddTask, nextWords, PlaceButtons } from "./task-form";

/** On the map: what the next click does for the task that is being added. */
export function TaskHint() {
  const kind = taskKind.value;
  const vehicle = controlledVehicle.value;
  if (kind === null || vehicle === null) return null;
  return (
    <div class="map-edit">
      <div class="map-hint task-hint" role="group" aria-label="Task on the map">
        <span>{nextWords(kind, vehicle.id)}</span>
        <AddTask vehicle={vehicle.id} />
        <PlaceButtons />
      </div>
    </div>
  );
}
