import { beforeEach, describe, expect, it, vi } from "vitest";
import type { TaskQueue } from "../api/types";
import type { QueueAsk } from "../hands-on/frames";
import { HANDS_OFF, type Refusal } from "../hands-on/session";
import { draggedText } from "../tasks/dragged";

vi.stubGlobal("location", { hash: "" });
const asked: QueueAsk[] = [];
let answer: (refusal: Refusal | null) => void;
vi.doMock("./hands-session", () => ({
  askQueue: (_: string, frame: QueueAsk) => new Promise<Refusal | null>((resolve) => [asked.push(frame), (answer = resolve)]),
}));
const { handsOn } = await import("./hands-on");
const { dropTask, moveTask, taskRefusal } = await import("./task-draft");

/** The service tells the queue anew. */
const tell = (...ids: string[]) => (handsOn.value = { ...HANDS_OFF, phase: "flying", vehicle: "v1", tasks: { tasks: ids.map((id) => ({ id })) } as TaskQueue });

beforeEach(() => {
  asked.length = 0;
  taskRefusal.value = null;
  tell("t1", "t2", "t3", "t4");
});

describe("a task that is dragged", () => {
  it("stays itself when the current one ends before it is dropped", async () => {
    const dragged = draggedText({ vehicle: "v1", task_id: "t3" });
    tell("t2", "t3", "t4");
    void dropTask(dragged, "v1", "t2");
    expect(asked).toEqual([{ type: "move", task_id: "t3", before: "t2" }]);
    answer(null);
  });

  it("is refused when it has ended itself, or is another vehicle's, and nothing is sent", async () => {
    tell("t2", "t3", "t4");
    await moveTask("t1", "t3");
    expect(taskRefusal.value?.code).toBe("task.gone");
    await dropTask(draggedText({ vehicle: "v2", task_id: "t3" }), "v1", "t2");
    expect(taskRefusal.value?.detail).toContain("a task of v2");
    expect(asked).toEqual([]);
  });
});
