import { beforeEach, describe, expect, it, vi } from "vitest";
import type { QueueRequest, TaskQueue } from "../../api/types";
import { readNumber } from "../../ui/fields";
import type { Refusal } from "../offboard/refusal";
import { NO_CONTROL } from "../offboard/session";
import { encodeDrag } from "./order";

vi.stubGlobal("location", { hash: "" });
const asked: QueueRequest[] = [];
let answer: (refusal: Refusal | null) => void;
vi.doMock("../offboard/control-session", () => ({
  requestQueue: (_: string, frame: QueueRequest) =>
    new Promise<Refusal | null>((resolve) => {
      asked.push(frame);
      answer = resolve;
    }),
}));
const { manualControl } = await import("../offboard/control-state");
const {
  addTask,
  changeForm,
  chooseTask,
  draftTask,
  dropTaskOnto,
  moveTask,
  nextTask,
  addTaskPoint,
  queueAction,
  resetField,
  taskForm,
  taskKind,
  taskRefusal,
  setNumber,
  watchTaskDraft,
  invalidFields,
} = await import("./task-draft");

/** The service tells the queue anew. */
const tell = (...ids: string[]) =>
  (manualControl.value = {
    ...NO_CONTROL,
    phase: "flying",
    vehicle: "v1",
    tasks: { tasks: ids.map((id) => ({ id })) } as TaskQueue,
  });

beforeEach(() => {
  asked.length = 0;
  taskRefusal.value = null;
  tell("t1", "t2", "t3", "t4");
});

describe("a task that is dragged", () => {
  it("stays itself when the current one ends before it is dropped", async () => {
    const dragged = encodeDrag({ vehicle: "v1", task_id: "t3" });
    tell("t2", "t3", "t4");
    void dropTaskOnto(dragged, "v1", "t2");
    expect(asked).toEqual([{ type: "move", task_id: "t3", before: "t2" }]);
    answer(null);
  });

  it("is refused when it has ended itself, or is another vehicle's, and nothing is sent", async () => {
    tell("t2", "t3", "t4");
    await moveTask("t1", "t3");
    expect(taskRefusal.value?.code).toBe("task.gone");
    await dropTaskOnto(encodeDrag({ vehicle: "v2", task_id: "t3" }), "v1", "t2");
    expect(taskRefusal.value?.detail).toContain("the task belongs to v2, not to v1");
    expect(asked).toEqual([]);
  });
});

describe("what is pressed twice", () => {
  const NOT_FOUND: Refusal = {
    action: "Next task",
    code: "resource.not_found",
    detail: "no task 't1' is in the queue",
    hint: "",
  };

  it("is asked once, and another thing does not wait for it", async () => {
    chooseTask("goto");
    addTaskPoint([8.55, 47.4]);
    const added = [addTask(), addTask()];
    expect(asked.map(({ type }) => type)).toEqual(["task"]);
    answer(null);
    await Promise.all(added);
    expect(taskKind.value).toBeNull();
    void nextTask("t1");
    const first = answer;
    const paused = queueAction("pause", "Pause");
    expect(asked.slice(1)).toEqual([
      { type: "remove", task_id: "t1" },
      { type: "queue", action: "pause" },
    ]);
    answer(null);
    first(null);
    expect(await paused).toBe(true);
  });

  it("leaves no second task out, though the list is not told anew yet", async () => {
    for (const refusal of [null, NOT_FOUND]) {
      const next = nextTask("t1");
      answer(refusal);
      await next;
    }
    expect(asked).toEqual([
      { type: "remove", task_id: "t1" },
      { type: "remove", task_id: "t1" },
    ]);
    expect(taskRefusal.value).toBeNull();
  });

  it("may be asked again once it was answered", async () => {
    const refused = queueAction("resume", "Fly the tasks");
    answer({ ...NOT_FOUND, code: "state.conflict" });
    expect([await refused, taskRefusal.value?.code]).toEqual([false, "state.conflict"]);
    void queueAction("resume", "Fly the tasks");
    expect([asked.length, taskRefusal.value]).toEqual([2, null]);
    answer(null);
  });
});

describe("the form", () => {
  it("is a new one for each lease, and a wing's has a circle that a wing flies", () => {
    watchTaskDraft();
    changeForm({ gripper: "release", speed_m_s: 3, radius_m: 10 });
    manualControl.value = { ...NO_CONTROL, phase: "leased", vehicle: "v3", tasksOnly: true };
    expect(taskForm.value).toMatchObject({ gripper: null, speed_m_s: null, radius_m: 80 });
    changeForm({ altitude_m: 40 });
    manualControl.value = { ...manualControl.value, phase: "flying" };
    expect(taskForm.value.altitude_m).toBe(40);
    manualControl.value = NO_CONTROL;
    tell("t1");
    expect(taskForm.value).toMatchObject({ altitude_m: null, radius_m: 20 });
  });
});

describe("a number that is typed", () => {
  const typed = (valueAsNumber: number, validity: Partial<ValidityState> = {}) => ({
    valueAsNumber,
    validity: { valid: true, badInput: false, ...validity },
  });
  const BAD = typed(NaN, { valid: false, badInput: true });

  beforeEach(() => {
    for (const field of ["altitude_m", "speed_m_s", "radius_m"] as const) resetField(field);
    changeForm({ altitude_m: null, radius_m: 20 });
    chooseTask("goto");
    addTaskPoint([8.55, 47.4]);
  });

  it("is not left out when it cannot be read: nothing is queued until it is fixed", async () => {
    setNumber("altitude_m", ...readNumber(BAD));
    expect([invalidFields.value, draftTask.value]).toEqual([{ altitude_m: "not a number" }, null]);
    await addTask();
    expect(asked).toEqual([]);
    setNumber("altitude_m", ...readNumber(typed(30)));
    expect([invalidFields.value, draftTask.value]).toMatchObject([{}, { relative_altitude_m: 30 }]);
    setNumber("altitude_m", ...readNumber(typed(NaN))); // emptied
    expect(draftTask.value).toMatchObject({ relative_altitude_m: null });
  });

  it("stays in its field while it is too small, and says how large it must be", () => {
    setNumber("speed_m_s", ...readNumber(typed(0, { valid: false }), 0.1));
    expect([taskForm.value.speed_m_s, invalidFields.value, draftTask.value]).toEqual([
      0,
      { speed_m_s: "at least 0.1" },
      null,
    ]);
    resetField("speed_m_s");
  });

  it("stops no task whose kind has no such field", () => {
    setNumber("radius_m", ...readNumber(BAD));
    expect(draftTask.value?.type).toBe("goto");
    chooseTask("circle");
    addTaskPoint([8.55, 47.4]);
    changeForm({ radius_m: 20 });
    expect(draftTask.value).toBeNull();
  });
});
