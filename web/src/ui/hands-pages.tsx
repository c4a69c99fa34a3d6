import { NONE_HELD } from "../hands-on/keys";
import { held } from "../state/controls";
import { manualControl, controlPage } from "../state/hands-on";
import { Icon } from "./icons";

/** Keys type and scroll from here on: none that is down goes on flying. */
function showTasks(): void {
  held.value = NONE_HELD;
  controlPage.value = "tasks";
}

/** While it is flown: the sticks, or the tasks. A gamepad counts with both, keys with the controls alone. */
export function OffboardPages() {
  const page = controlPage.value;
  const queued = manualControl.value.tasks?.tasks.length ?? 0;
  return (
    <div class="offboard-pages" role="group" aria-label="Fly by">
      <button type="button" aria-pressed={page === "controls"} onClick={() => (controlPage.value = "controls")}>
        <Icon name="joystick" size={17} />
        Controls
      </button>
      <button type="button" aria-pressed={page === "tasks"} onClick={showTasks}>
        <Icon name="plan" size={17} />
        Tasks{queued > 0 && ` (${queued})`}
      </button>
    </div>
  );
}
