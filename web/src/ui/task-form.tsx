import { useEffect } from "preact/hooks";
import { addTask, changeForm, chooseTask, draftTarget, draftTask, showField, taskForm, taskKind, taskPlaces, takePlaceBack, typeNumber, wrongFields } from "../state/task-draft";
import { tasksOnly } from "../state/offboard-facts";
import { taskQueue } from "../state/task-queue";
import { followedBy, TASK_KINDS, WING_RADIUS_M, type NumericField, type TaskForm as Form, type TaskKind } from "../tasks/draft";
import { followWords, kindName, placeWords } from "../tasks/words";
import { Choice } from "./choice";
import { FollowChoice } from "./follow-choice";
import { HoldButton } from "./hold-button";
import { NumberField } from "./number-field";
import { PassingButton } from "./passing-button";
import { Icon, type IconName } from "./icons";

const ICONS: Readonly<Record<TaskKind, IconName>> = { goto: "follow", circle: "circle", segment: "segment", path: "plan" };

/** Another task for the queue: its places by clicks on the map, the rest by fields. */
export function TaskForm({ vehicle }: { vehicle: string }) {
  const kind = taskKind.value;
  return (
    <div class="task-form">
      <div class="task-kinds" role="group" aria-label="Add a task">
        {TASK_KINDS.map((choice) => (
          <button key={choice} type="button" aria-pressed={kind === choice} onClick={() => chooseTask(kind === choice ? null : choice)}>
            <Icon name={ICONS[choice]} size={18} />
            {kindName(choice)}
          </button>
        ))}
      </div>
      {kind === null ? <p class="hint">Choose what {vehicle} shall fly, then click on the map. Without a mouse: on the map, arrows move it, Space takes its middle, Enter adds the task.</p> : <Fields kind={kind} vehicle={vehicle} />}
    </div>
  );
}

function Fields({ kind, vehicle }: { kind: TaskKind; vehicle: string }) {
  const form = taskForm.value;
  const isWing = tasksOnly.value;
  const feed = followedBy(kind, form);
  return (
    <>
      <p class="task-places">
        <span role="status">{nextWords(kind, vehicle)}</span>
        {feed === null && (
          <button type="button" class="small" onClick={focusMap}>
            To the map
          </button>
        )}
      </p>
      {kind === "goto" && <FollowChoice />}
      <div class="fields">
        <DraftNumber name="Height above home" unit="m" field="altitude_m" empty="as it is" />
        {!isWing && <DraftNumber name="Speed" unit="m/s" field="speed_m_s" empty="its own" min={0.1} />}
        <DraftNumber name="Duration" unit="s" field="duration_s" empty="no limit" min={1} />
        {kind === "circle" && <DraftNumber name="Radius" unit="m" field="radius_m" empty="needed" min={isWing ? WING_RADIUS_M.least : 1} />}
        {kind === "circle" && (
          <Choice name="Direction" value={form.clockwise ? "clockwise" : "counter"} onChange={(value) => changeForm({ clockwise: value === "clockwise" })}>
            <option value="clockwise">Clockwise</option>
            <option value="counter">Counter-clockwise</option>
          </Choice>
        )}
        {kind === "goto" && feed === null && (
          <Choice name="There" value={form.gripper ?? (form.stay ? "stay" : "")} onChange={(value) => changeForm({ gripper: value === "release" || value === "grab" ? value : null, stay: value === "stay" })}>
            <option value="">Go on</option>
            <option value="stay">{isWing ? "Stay and circle" : "Stay"}</option>
            {!isWing && <option value="release">Release the parcel</option>}
            {!isWing && <option value="grab">Grab with the gripper</option>}
          </Choice>
        )}
        <Choice name="Where in the queue" value={form.insert} onChange={(value) => changeForm({ insert: value as Form["insert"] })}>
          <option value="append">At the end</option>
          <option value="prepend">Now, before the current</option>
          <option value="replace_current">Now, instead of the current</option>
          <option value="replace_all">Now, instead of all</option>
        </Choice>
        <Choice name="After the last task" value={form.whenEmpty} onChange={(value) => changeForm({ whenEmpty: value as Form["whenEmpty"] })}>
          <option value="wait">{isWing ? "Circle and wait" : "Stand and wait"}</option>
          <option value="plan">Back to the run, or hold</option>
        </Choice>
      </div>
      <div class="actions">
        <AddTask vehicle={vehicle} />
        <PlaceButtons />
      </div>
    </>
  );
}

/** What is to be done next. */
export function nextWords(kind: TaskKind, vehicle: string): string {
  const feed = followedBy(kind, taskForm.value);
  return feed === null ? placeWords(kind, taskPlaces.value.length, vehicle) : followWords(vehicle, feed, draftTarget.value?.stale === false);
}

/** For the keyboard: there Space takes the middle, Enter adds the task, and arrows move the map. */
function focusMap(): void {
  document.querySelector<HTMLElement>(".map-canvas canvas")?.focus();
}

/** What moves a vehicle at once is one press; a parcel is released only by a button that is held. */
export function AddTask({ vehicle }: { vehicle: string }) {
  const task = draftTask.value;
  const { gripper } = taskForm.value;
  const add = () => void addTask();
  if (taskKind.value === "goto" && gripper !== null) return <HoldButton verb={gripper === "release" ? "Add a release by" : "Add a grab by"} vehicle={vehicle} tone="drop" disabled={task === null} onConfirm={add} />;
  const now = taskForm.value.insert !== "append" && (taskQueue.value?.tasks.length ?? 0) > 0;
  return <PassingButton look="primary" name={now ? "Fly it now" : "Add to the queue"} off={task === null} onClick={add} />;
}

/** Undo the last click, or give the task up. */
export function PlaceButtons() {
  return (
    <>
      <PassingButton name="Undo" off={taskPlaces.value.length === 0} onClick={takePlaceBack} />
      <PassingButton name="Cancel" onClick={() => chooseTask(null)} />
    </>
  );
}

interface DraftProps {
  name: string;
  unit: "m" | "m/s" | "s";
  field: NumericField;
  empty: string;
  min?: number;
}

/** A number of the task that is put together. */
function DraftNumber({ field, ...look }: DraftProps) {
  useEffect(() => showField(field), [field]);
  return <NumberField {...look} value={taskForm.value[field]} wrong={wrongFields.value[field] ?? ""} onType={(value, wrong) => typeNumber(field, value, wrong)} />;
}
