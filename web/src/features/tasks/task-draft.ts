/** The task being drawn for the vehicle whose lease this page has, and the requests to its queue. */

import { batch, computed, effect, signal } from "@preact/signals";
import type { QueueAction, QueueRequest, TaskTerms } from "../../api/types";
import type { Point } from "../../geo/geometry";
import { requestQueue } from "../offboard/control-session";
import { goToArmed, manualControl } from "../offboard/control-state";
import type { Refusal } from "../offboard/refusal";
import { sightingIn, targetReports } from "../targets/reports";
import { currentMotion } from "../targets/targets";
import {
  addPoint,
  buildTask,
  DEFAULT_FORM,
  defaultForm,
  followedFeed,
  type NumericField,
  type TaskForm,
  type TaskKind,
} from "./draft";
import { followedTasks, followWith } from "./followed-tasks";
import { decodeDrag, moveOnto } from "./order";
import { ownsQueue, taskQueue } from "./queue";

/** The active tool: the next click on the map adds a point of such a task. */
export const taskKind = signal<TaskKind | null>(null);
export const taskPoints = signal<readonly Point[]>([]);
export const taskForm = signal<TaskForm>(DEFAULT_FORM);
/** Why the queue did not do what was asked last. */
export const taskRefusal = signal<Refusal | null>(null);

/**
 * What is wrong with what stands in a field. Nothing is queued over it: the field would say one thing, and the task
 * another.
 */
export const invalidFields = signal<Readonly<Partial<Record<NumericField, string>>>>({});

/** The target that the task shall follow, as it was when it was read; null: none. */
export const draftTarget = computed(() => {
  const feed = taskKind.value === null ? null : followedFeed(taskKind.value, taskForm.value);
  const read = targetReports.value;
  return feed === null || read === null ? null : sightingIn(read, feed, 0);
});

export const draftTask = computed(() => {
  const kind = taskKind.value;
  const wrong = Object.keys(invalidFields.value).some((field) => kind === "circle" || field !== "radius_m");
  const target = draftTarget.value;
  return kind === null || wrong
    ? null
    : buildTask(kind, taskPoints.value, taskForm.value, target && currentMotion(target));
});

export function chooseTask(kind: TaskKind | null): void {
  batch(() => {
    taskKind.value = kind;
    taskPoints.value = [];
    taskRefusal.value = null;
    goToArmed.value = false;
  });
}

export function changeForm(change: Partial<TaskForm>): void {
  taskForm.value = { ...taskForm.value, ...change };
}

export function setNumber(field: NumericField, value: number | null, wrong: string): void {
  batch(() => {
    changeForm({ [field]: value });
    markField(field, wrong);
  });
}

/** A field that is shown anew shows the form's own value: nothing is wrong with it. */
export const resetField = (field: NumericField): void => markField(field, "");

function markField(field: NumericField, wrong: string): void {
  const { [field]: _, ...others } = invalidFields.value;
  invalidFields.value = wrong === "" ? others : { ...others, [field]: wrong };
}

/** A click on the map. True if it was meant for a task. */
export function addTaskPoint(at: Point): boolean {
  const kind = taskKind.value;
  if (kind === null) return false;
  if (followedFeed(kind, taskForm.value) === null) taskPoints.value = addPoint(kind, taskPoints.value, at);
  return true;
}

export function undoTaskPoint(): void {
  taskPoints.value = taskPoints.value.slice(0, -1);
}

/** Queues the task. A refused one stays as it is, to be changed. */
export async function addTask(): Promise<void> {
  const task = draftTask.value;
  const { insert, whenEmpty, follow } = taskForm.value;
  if (task === null) return;
  const onQueued = (id: string) =>
    task.type === "goto" && task.motion !== null && follow !== null && followWith(id, follow);
  if (await ask("Add the task", { type: "task", task, insert, when_empty: whenEmpty }, onQueued)) {
    batch(() => {
      if (draftTask.value !== null) chooseTask(null);
      // said anew for each task
      changeForm({ gripper: null, stay: false, duration_s: null, follow: null, insert: "append" });
    });
  }
}

export const queueAction = (action: QueueAction, label: string): Promise<boolean> =>
  ask(label, { type: "queue", action });

/** Done with this task, by its id: pressed twice, or as it ends by itself, it leaves no other one out. */
export async function nextTask(id: string): Promise<void> {
  await ask("Next task", { type: "remove", task_id: id });
  if (taskRefusal.value?.code === "resource.not_found") taskRefusal.value = null; // it is over, as was asked
}

/** Changes how a waiting task is flown. */
export const changeTask = (id: string, place: number, change: TaskTerms): Promise<boolean> =>
  ask(`Edit task ${place + 1}`, { type: "change", task_id: id, change });

export const removeTask = (id: string, place: number): Promise<boolean> =>
  ask(`Remove task ${place + 1}`, { type: "remove", task_id: id });

/** Into the place of another task; the first is flown at once. */
export async function moveTask(id: string, onto: string): Promise<void> {
  const ids = taskQueue.value?.tasks.map((entry) => entry.id) ?? [];
  const move = moveOnto(ids, id, onto);
  if (move !== null) await ask(`Move task ${ids.indexOf(id) + 1}`, { type: "move", ...move });
  else if (id !== onto)
    taskRefusal.value = {
      action: "Move a task",
      code: "task.gone",
      detail: "one of the two tasks is no longer in the queue",
      hint: "",
    };
}

/** What was dragged is dropped onto a task of this vehicle. */
export async function dropTaskOnto(text: string, vehicle: string, onto: string): Promise<void> {
  const dragged = decodeDrag(text);
  if (dragged === null) return;
  if (dragged.vehicle === vehicle) return moveTask(dragged.task_id, onto);
  taskRefusal.value = {
    action: "Move a task",
    code: "task.other_vehicle",
    detail: `the task belongs to ${dragged.vehicle}, not to ${vehicle}`,
    hint: "",
  };
}

const awaited = new Set<string>();

/** The same again while its answer is awaited is a button pressed twice; another thing, a pause say, never waits. */
async function ask(action: string, frame: QueueRequest, onQueued?: (task_id: string) => void): Promise<boolean> {
  const same = JSON.stringify(frame);
  if (awaited.has(same)) return false;
  awaited.add(same);
  taskRefusal.value = null;
  const refusal = await requestQueue(action, frame, onQueued).finally(() => awaited.delete(same));
  taskRefusal.value = refusal;
  return refusal === null;
}

/** A form is for one lease: the next vehicle may be a wing. */
const formFor = computed(() =>
  manualControl.value.phase === "off" ? "" : `${manualControl.value.vehicle}\n${manualControl.value.tasksOnly}`,
);

/** The tool is put away with the lease, and for another tool. */
export function watchTaskDraft(): void {
  effect(() => {
    if (formFor.value === "") return;
    batch(() => {
      taskForm.value = defaultForm(manualControl.peek().tasksOnly);
      invalidFields.value = {};
    });
  });
  effect(() => {
    if (!ownsQueue.value || goToArmed.value) taskKind.value = null;
  });
  effect(() => {
    if (taskKind.value === null) taskPoints.value = [];
  });
  effect(() => {
    // earlier refusals belong to another lease; a refusal because the lease ended comes after its end
    void ownsQueue.value;
    taskRefusal.value = null;
  });
}

/** All that report, while a task is put together that may follow one, or follows one already. */
export const taskMayFollow = computed(
  () => ownsQueue.value && (taskKind.value === "goto" || followedTasks.value.size > 0),
);
