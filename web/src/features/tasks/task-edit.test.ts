import { describe, expect, it } from "vitest";
import type { QueuedTask, Task } from "../../api/types";
import { buildTask, DEFAULT_FORM } from "./draft";
import { canEditTask, changedTerms, editForm, missingFields } from "./task-edit";

const circle = buildTask("circle", [[8.55, 47.4]], {
  ...DEFAULT_FORM,
  clockwise: false,
  altitude_m: 25,
  duration_s: 30,
}) as Task;
const goto = buildTask("goto", [[8.55, 47.4]], DEFAULT_FORM) as Task;

describe("a task that is edited", () => {
  it("says nothing while nothing is another", () => {
    expect([changedTerms(circle, editForm(circle)), changedTerms(goto, editForm(goto))]).toEqual([null, null]);
  });

  it("says only what is another; an empty field is no limit, its own speed, and the height of then", () => {
    expect(changedTerms(circle, { ...editForm(circle), duration_s: 60 })).toEqual({ duration_s: 60 });
    expect(changedTerms(circle, { ...editForm(circle), duration_s: null, altitude_m: null })).toEqual({
      duration_s: -1,
      relative_altitude_m: null,
    });
    expect(changedTerms(goto, { ...editForm(goto), speed_m_s: 3 })).toEqual({ speed_m_s: 3 });
  });

  it("keeps the direction of a circle, which needs a radius", () => {
    expect(changedTerms(circle, { ...editForm(circle), radius_m: 40 })).toEqual({ radius_m: -40 });
    expect([
      missingFields(circle, { ...editForm(circle), radius_m: null }),
      missingFields(goto, editForm(goto)),
    ]).toEqual([{ radius_m: "required" }, {}]);
  });

  it("counts its height from where it did", () => {
    const high: Task = { ...goto, absolute_altitude_m: 520 };
    expect(editForm(high)).toMatchObject({ above: "sea", altitude_m: 520 });
    expect(changedTerms(high, { ...editForm(high), altitude_m: 530 })).toEqual({ absolute_altitude_m: 530 });
  });

  it("waits for its turn: the first one until the vehicle is under control", () => {
    const tasks = ["t1", "t2"].map((id) => ({ id }) as QueuedTask);
    expect([
      canEditTask(tasks, "t1", true),
      canEditTask(tasks, "t1", false),
      canEditTask(tasks, "t2", false),
      canEditTask(tasks, "t3", true),
    ]).toEqual([true, false, true, false]);
  });
});
