import { useEffect } from "preact/hooks";
import { viewCentre } from "../map/camera";
import { engaged } from "../state/hands-on";
import { addTask, chooseTask, placeTask, takePlaceBack, taskForm, taskKind } from "../state/task-draft";

/** On the map with a task in hand: Space takes its middle, Backspace gives the last place back, Enter adds the task. */
export function useTaskKeys(): void {
  useEffect(() => {
    const onKeyDown = (event: KeyboardEvent) => {
      if (taskKind.value === null || event.repeat || !(event.target instanceof Element)) return;
      if (event.key === "Escape" && !engaged.value) return chooseTask(null); // else it leaves to Hold, as everywhere
      if (event.target.closest(".map-canvas") !== null && onMapKey(event.key)) event.preventDefault();
    };
    window.addEventListener("keydown", onKeyDown);
    return () => window.removeEventListener("keydown", onKeyDown);
  }, []);
}

/** True if the key was for the task. A release is added by its button alone, which is held. */
function onMapKey(key: string): boolean {
  if (key === " ") return placeTask(viewCentre.value);
  if (key === "Backspace") takePlaceBack();
  else if (key === "Enter" && taskForm.value.gripper === null) void addTask();
  else return false;
  return true;
}
