import { beforeEach, describe, expect, it, vi } from "vitest";
import type { QueueRequest, Target, TaskQueue } from "../../api/types";
import type { Refusal } from "../offboard/refusal";
import { NO_CONTROL } from "../offboard/session";

const page = { hidden: false, looks: true };
vi.stubGlobal("location", { hash: "" });
vi.stubGlobal("document", { ...page, hasFocus: () => page.looks });
const asked: QueueRequest[] = [];
let refusal: Refusal | null;
vi.doMock("../offboard/control-session", () => ({
  requestQueue: (_: string, frame: QueueRequest, onQueued?: (id: string) => void) => {
    asked.push(frame);
    onQueued?.("t1");
    return Promise.resolve(refusal);
  },
}));
const { manualControl } = await import("../offboard/control-state");
const { followedTasks, watchFollowedTasks } = await import("./followed-tasks");
const { targetReports } = await import("../targets/reports");
const { addTask, changeForm, chooseTask, draftTask, addTaskPoint, taskForm, taskPoints } = await import("./task-draft");
watchFollowedTasks();

const SHIP: Target = {
  feed: "ship-1",
  report: { latitude_deg: 47.4, longitude_deg: 8.55, north_m_s: 2, east_m_s: 0, time: 1000 },
  age_s: 0,
  stale: false,
};
const settled = () => new Promise((resolve) => setTimeout(resolve));

/** The service's next answer: reported at this time, so old by now. */
async function hear(time: number, age_s = 0): Promise<void> {
  targetReports.value = {
    targets: { "ship-1": { ...SHIP, report: { ...SHIP.report, time }, age_s } },
    at: performance.now(),
  };
  await settled();
}
const told = () => asked.filter(({ type }) => type === "target");

beforeEach(async () => {
  [asked.length, refusal, page.looks] = [0, null, true];
  manualControl.value = NO_CONTROL;
  manualControl.value = {
    ...NO_CONTROL,
    phase: "flying",
    vehicle: "v1",
    tasks: { tasks: [{ id: "t1" }, { id: "t2" }] } as TaskQueue,
  };
  chooseTask("goto");
  await hear(1000);
});

async function following(): Promise<void> {
  changeForm({ follow: "ship-1" });
  await addTask();
}

describe("a task that follows a target", () => {
  it("is queued with its place and motion, wherever the map is clicked, and is forgotten by the form", async () => {
    changeForm({ follow: "ship-1" });
    addTaskPoint([8, 47]);
    expect(taskPoints.value).toEqual([]);
    await addTask();
    expect(asked[0]).toMatchObject({ type: "task", task: { type: "goto", motion: { north_m_s: 2, east_m_s: 0 } } });
    expect([followedTasks.value.get("t1")?.feed, taskForm.value.follow]).toEqual(["ship-1", null]);
  });

  it("waits until its target is heard of", async () => {
    changeForm({ follow: "ship-1" });
    await hear(1001, 7);
    expect(draftTask.value).toBeNull();
    await hear(1002);
    expect(draftTask.value?.type).toBe("goto");
    changeForm({ follow: null });
  });

  it("is told each report once, and none that is too old", async () => {
    await following();
    for (const [time, age_s] of [
      [1001, 0],
      [1001, 1],
      [1002, 0],
      [1002, 4],
      [1003, 6],
    ] as const)
      await hear(time, age_s);
    expect(told()).toMatchObject([{ task_id: "t1" }, { task_id: "t1" }]);
  });

  it("is told nothing while nobody looks at the page: that would keep the lease", async () => {
    await following();
    page.looks = false;
    await hear(1001);
    expect(told()).toEqual([]);
    page.looks = true;
    await hear(1001, 1);
    expect(told().length).toBe(1);
  });

  it("says why its target was not taken, until it is", async () => {
    await following();
    refusal = { action: "", code: "limit.distance", detail: "too far", hint: "" };
    await hear(1001);
    expect(followedTasks.value.get("t1")?.refusal?.detail).toBe("too far");
    refusal = null;
    await hear(1002);
    expect(followedTasks.value.get("t1")?.refusal).toBeNull();
  });

  it("is its lease's: the next one begins with none", async () => {
    await following();
    manualControl.value = { ...manualControl.value, phase: "leaving" };
    expect(followedTasks.value.size).toBe(1);
    manualControl.value = NO_CONTROL;
    expect(followedTasks.value.size).toBe(0);
  });
});
