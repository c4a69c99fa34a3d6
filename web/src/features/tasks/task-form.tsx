import { useEffect } from "preact/hooks";
import { secondsSince } from "../../store/clock";
import { mapCentre } from "../../store/map-view";
import { HoldButton, TransientButton } from "../../ui/buttons";
import { NumberField, SelectField } from "../../ui/fields";
import { Icon, type IconName } from "../../ui/icons";
import { needsTask, tasksOnly } from "../offboard/capabilities";
import { controlledVehicle, engaged } from "../offboard/control-state";
import { sightingIn, targetReports } from "../targets/reports";
import { describeMotion } from "../targets/targets";
import {
  type TaskForm as Form,
  followedFeed,
  type NumericField,
  TASK_KINDS,
  type TaskKind,
  WING_RADIUS_M,
} from "./draft";
import { followHint, nextPointHint, taskKindLabel } from "./labels";
import { taskQueue } from "./queue";
import {
  addTask,
  addTaskPoint,
  changeForm,
  chooseTask,
  draftTarget,
  draftTask,
  invalidFields,
  resetField,
  setNumber,
  taskForm,
  taskKind,
  taskPoints,
  undoTaskPoint,
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
            {taskKindLabel(choice)}
          </button>
        ))}
      </div>
      {kind === null ? (
        <p class="hint">
          Select what {vehicle} should fly, then click on the map. With the keyboard: arrows move the map, Space adds
          its centre, Enter adds the task.
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
  const feed = followedFeed(kind, form);
  return (
    <>
      <p class="task-places">
        <span role="status">{nextHint(kind, vehicle)}</span>
        {feed === null && (
          <button type="button" class="small" onClick={focusMap}>
            Focus the map
          </button>
        )}
      </p>
      {kind === "goto" && <FollowChoice />}
      <div class="fields">
        <DraftNumber name="Height above home" unit="m" field="altitude_m" empty="current" />
        {!isWing && <DraftNumber name="Speed" unit="m/s" field="speed_m_s" empty="default" min={0.1} />}
        <DraftNumber name="Duration" unit="s" field="duration_s" empty="no limit" min={1} />
        {kind === "circle" && (
          <DraftNumber
            name="Radius"
            unit="m"
            field="radius_m"
            empty="required"
            min={isWing ? WING_RADIUS_M.least : 1}
          />
        )}
        {kind === "circle" && (
          <SelectField
            name="Direction"
            value={form.clockwise ? "clockwise" : "counter"}
            onChange={(value) => changeForm({ clockwise: value === "clockwise" })}
          >
            <option value="clockwise">Clockwise</option>
            <option value="counter">Counter-clockwise</option>
          </SelectField>
        )}
        {kind === "goto" && feed === null && (
          <SelectField
            name="On arrival"
            value={form.gripper ?? (form.stay ? "stay" : "")}
            onChange={(value) =>
              changeForm({ gripper: value === "release" || value === "grab" ? value : null, stay: value === "stay" })
            }
          >
            <option value="">Continue</option>
            <option value="stay">{isWing ? "Stay and circle" : "Stay"}</option>
            {!isWing && <option value="release">Release the parcel</option>}
            {!isWing && <option value="grab">Grab with the gripper</option>}
          </SelectField>
        )}
        <SelectField
          name="Position in the queue"
          value={form.insert}
          onChange={(value) => changeForm({ insert: value as Form["insert"] })}
        >
          <option value="append">At the end</option>
          <option value="prepend">Now, before the current task</option>
          <option value="replace_current">Now, instead of the current task</option>
          <option value="replace_all">Now, instead of all tasks</option>
        </SelectField>
        <SelectField
          name="After the last task"
          value={form.whenEmpty}
          onChange={(value) => changeForm({ whenEmpty: value as Form["whenEmpty"] })}
        >
          <option value="wait">{isWing ? "Circle and wait" : "Stop and wait"}</option>
          <option value="plan">Resume the run, or hold</option>
        </SelectField>
      </div>
      <div class="actions">
        <AddTask vehicle={vehicle} />
        <PointButtons />
      </div>
    </>
  );
}

/** What is to be done next. */
function nextHint(kind: TaskKind, vehicle: string): string {
  const feed = followedFeed(kind, taskForm.value);
  return feed === null
    ? nextPointHint(kind, taskPoints.value.length, vehicle)
    : followHint(vehicle, feed, draftTarget.value?.stale === false);
}

/** For the keyboard: there Space takes the middle, Enter adds the task, and arrows move the map. */
function focusMap(): void {
  document.querySelector<HTMLElement>(".map-canvas canvas")?.focus();
}

/** What moves a vehicle at once is one press; a parcel is released only by a button that is held. */
function AddTask({ vehicle }: { vehicle: string }) {
  const task = draftTask.value;
  const { gripper } = taskForm.value;
  const add = () => void addTask();
  if (taskKind.value === "goto" && gripper !== null)
    return (
      <HoldButton
        verb={gripper === "release" ? "Queue a release by" : "Queue a grab by"}
        vehicle={vehicle}
        tone="drop"
        disabled={task === null}
        onConfirm={add}
      />
    );
  const now = taskForm.value.insert !== "append" && (taskQueue.value?.tasks.length ?? 0) > 0;
  const isNext = !engaged.value && needsTask.value; // else it is the way into or out of control
  return (
    <TransientButton
      look={isNext ? "primary" : "small"}
      name={now ? "Fly it now" : "Add to the queue"}
      off={task === null}
      onClick={add}
    />
  );
}

/** Undo the last click, or give the task up. */
function PointButtons() {
  return (
    <>
      <TransientButton name="Undo" off={taskPoints.value.length === 0} onClick={undoTaskPoint} />
      <TransientButton name="Cancel" onClick={() => chooseTask(null)} />
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
  useEffect(() => resetField(field), [field]);
  return (
    <NumberField
      {...look}
      value={taskForm.value[field]}
      wrong={invalidFields.value[field] ?? ""}
      onType={(value, wrong) => setNumber(field, value, wrong)}
    />
  );
}

/** A point on the map, or one of the moving targets that report. Nothing while there are none. */
function FollowChoice() {
  const { follow } = taskForm.value;
  const read = targetReports.value;
  const feeds = Object.keys(read?.targets ?? {});
  if (feeds.length === 0 && follow === null) return null;
  const all = follow === null || feeds.includes(follow) ? feeds : [follow, ...feeds];
  return (
    <div class="task-follow">
      <SelectField
        name="Destination"
        value={follow ?? ""}
        onChange={(feed) => changeForm(feed === "" ? { follow: null } : { follow: feed, gripper: null, stay: false })}
      >
        <option value="">A point on the map</option>
        {all.map((feed) => (
          <option key={feed} value={feed}>
            Follow {feed}
          </option>
        ))}
      </SelectField>
      {follow !== null && read !== null && (
        <small class="hint">{describeMotion(sightingIn(read, follow, secondsSince(read.at)))}</small>
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
        <span>{nextHint(kind, vehicle.id)}</span>
        <AddTask vehicle={vehicle.id} />
        <PointButtons />
      </div>
    </div>
  );
}

/** On the map with a task tool: Space adds the centre, Backspace removes the last point, Enter adds the task. */
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
  if (key === " ") return addTaskPoint(mapCentre.value);
  if (key === "Backspace") undoTaskPoint();
  else if (key === "Enter" && taskForm.value.gripper === null) void addTask();
  else return false;
  return true;
}
