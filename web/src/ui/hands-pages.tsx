import { handsOn, handsPage } from "../state/hands-on";
import { Icon } from "./icons";

/** While it is flown: the controls for hands, or the tasks. Keys and a gamepad count on both. */
export function HandsPages() {
  const page = handsPage.value;
  const queued = handsOn.value.tasks?.tasks.length ?? 0;
  return (
    <div class="hands-pages" role="group" aria-label="Fly by">
      <button type="button" aria-pressed={page === "controls"} onClick={() => (handsPage.value = "controls")}>
        <Icon name="hands" size={17} />
        Controls
      </button>
      <button type="button" aria-pressed={page === "tasks"} onClick={() => (handsPage.value = "tasks")}>
        <Icon name="plan" size={17} />
        Tasks{queued > 0 && ` (${queued})`}
      </button>
    </div>
  );
}
