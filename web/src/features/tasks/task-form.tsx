import { useEffect } from "preact/hooks";
import { secondsSince } from "../../store/clock";
import { viewCentre } from "../../store/map-view";
import { HoldButton, PassingButton } from "../../ui/buttons";
import { Choice, NumberField } from "../../ui/fields";
import { Icon, type IconName } from "../../ui/icons";
import { tasksOnly } from "../offboard/capabilities";
import { controlledVehicle, engaged } from "../offboard/control-state";
import { reports, seenIn } from "../targets/reports";
import { motionWords } from "../targets/targets";
import {
  type TaskForm as Form,
  followedBy,
  type NumericField,
  TASK_KINDS,
  type TaskKind,
  WING_RADIUS_M,
} from "./draft";
import { followWords, kindName, placeWords } from "./labels";
import { taskQueue } from "./queue";
import {
  addTask,
  changeForm,
  chooseTask,
  draftTarget,
  draftTask,
  placeTask,
  showField,
  takePlaceBack,
  taskForm,
  taskKind,
  taskPlaces,
  typeNumber,
  wrongFields,
} from "./task-draft";

const ICONS: Readonly<Record<TaskKind, IconName>> = {
  goto: "follow",
  circle: "circle",
  segment: "segment",
  path: "plan",
};

/** Another task for the queue: its places by clicks on the map, the rest by fields. */
export function TaskForm({ vehicle }: { vehicle: string }) {
  const kind = taskKind.value;
  return (
    <div class="task-form">
      <div class="task-kinds" role="group" aria-label="Add a task">
        {TASK_KINDS.map((choice) => (
          <button
            key={choice}
            type="button"
            aria-pressed={kind === choice}
            onClick={() => chooseTask(kind === choice ? null : choice)}
          >
            <Icon name={ICONS[choice]} size={18} />
            {kindName(choice)}
          </button>
        ))}
      </div>
      {kind === null ? (
        <p class="hint">
          Choose what {vehicle} shall fly, then click on the map. Without a mouse: on the map, arrows move it, Space
          takes its middle, Enter adds the task.
        </p>
      ) : (
        <Fields kind={kind} vehicle={vehicle} />
      )}
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
        {kind === "circle" && (
          <DraftNumber name="Radius" unit="m" field="radius_m" empty="needed" min={isWing ? WING_RADIUS_M.least : 1} />
        )}
        {kind === "circle" && (
          <Choice
            name="Direction"
            value={form.clockwise ? "clockwise" : "counter"}
            onChange={(value) => changeForm({ clockwise: value === "clockwise" })}
          >
            <option value="clockwise">Clockwise</option>
            <option value="counter">Counter-clockwise</option>
          </Choice>
        )}
        {kind === "goto" && feed === null && (
          <Choice
            name="There"
            value={form.gripper ?? (form.stay ? "stay" : "")}
            onChange={(value) =>
              changeForm({ gripper: value === "release" || value === "grab" ? value : null, stay: value === "stay" })
            }
          >
            <option value="">Go on</option>
            <option value="stay">{isWing ? "Stay and circle" : "Stay"}</option>
            {!isWing && <option value="release">Release the parcel</option>}
            {!isWing && <option value="grab">Grab with the gripper</option>}
          </Choice>
        )}
        <Choice
          name="Where in the queue"
          value={form.insert}
          onChange={(value) => changeForm({ insert: value as Form["insert"] })}
        >
          <option value="append">At the end</option>
          <option value="prepend">Now, before the current</option>
          <option value="replace_current">Now, instead of the current</option>
          <option value="replace_all">Now, instead of all</option>
        </Choice>
        <Choice
          name="After the last task"
          value={form.whenEmpty}
          onChange={(value) => changeForm({ whenEmpty: value as Form["whenEmpty"] })}
        >
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
  return feed === null
    ? placeWords(kind, taskPlaces.value.length, vehicle)
    : followWords(vehicle, feed, draftTarget.value?.stale === false);
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
  if (taskKind.value === "goto" && gripper !== null)
    return (
      <HoldButton
        verb={gripper === "release" ? "Add a release by" : "Add a grab by"}
        vehicle={vehicle}
        tone="drop"
        disabled={task === null}
        onConfirm={add}
      />
    );
  const now = taskForm.value.insert !== "append" && (taskQueue.value?.tasks.length ?? 0) > 0;
  return (
    <PassingButton look="primary" name={now ? "Fly it now" : "Add to the queue"} off={task === null} onClick={add} />
  );
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
  return (
    <NumberField
      {...look}
      value={taskForm.value[field]}
      wrong={wrongFields.value[field] ?? ""}
      onType={(value, wrong) => typeNumber(field, value, wrong)}
    />
  );
}

/** A place on the map, or one of the moving targets that report. Nothing while there are none. */
export function FollowChoice() {
  const { follow } = taskForm.value;
  const read = reports.value;
  const feeds = Object.keys(read?.targets ?? {});
  if (feeds.length === 0 && follow === null) return null;
  const all = follow === null || feeds.includes(follow) ? feeds : [follow, ...feeds];
  return (
    <div class="task-follow">
      <Choice
        name="Where to"
        value={follow ?? ""}
        onChange={(feed) => changeForm(feed === "" ? { follow: null } : { follow: feed, gripper: null, stay: false })}
      >
        <option value="">A place on the map</option>
        {all.map((feed) => (
          <option key={feed} value={feed}>
            Follow {feed}
          </option>
        ))}
      </Choice>
      {follow !== null && read !== null && (
        <small class="hint">{motionWords(seenIn(read, follow, secondsSince(read.at)))}</small>
      )}
    </div>
  );
}

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
