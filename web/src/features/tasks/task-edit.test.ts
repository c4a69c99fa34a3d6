import { describe, expect, it } from "vitest";
import type { QueuedTask, Task } from "../../api/types";
import { NEW_FORM, taskOf } from "./draft";
import { mayBeMended, mendForm, missing, termsOf } from "./task-edit";

const circle = taskOf("circle", [[8.55, 47.4]], {
  ...NEW_FORM,
  clockwise: false,
  altitude_m: 25,
  duration_s: 30,
}) as Task;
const goto = taskOf("goto", [[8.55, 47.4]], NEW_FORM) as Task;

describe("a task that is mended", () => {
  it("says nothing while nothing is another", () => {
    expect([termsOf(circle, mendForm(circle)), termsOf(goto, mendForm(goto))]).toEqual([null, null]);
  });

  it("says only what is another; an empty field is no limit, its own speed, and the height of then", () => {
    expect(termsOf(circle, { ...mendForm(circle), duration_s: 60 })).toEqual({ duration_s: 60 });
    expect(termsOf(circle, { ...mendForm(circle), duration_s: null, altitude_m: null })).toEqual({
      duration_s: -1,
      relative_altitude_m: null,
    });
    expect(termsOf(goto, { ...mendForm(goto), speed_m_s: 3 })).toEqual({ speed_m_s: 3 });
  });

  it("keeps the direction of a circle, which needs a radius", () => {
    expect(termsOf(circle, { ...mendForm(circle), radius_m: 40 })).toEqual({ radius_m: -40 });
    expect([missing(circle, { ...mendForm(circle), radius_m: null }), missing(goto, mendForm(goto))]).toEqual([
      { radius_m: "needed" },
      {},
    ]);
  });

  it("counts its height from where it did", () => {
    const high: Task = { ...goto, absolute_altitude_m: 520 };
    expect(mendForm(high)).toMatchObject({ above: "sea", altitude_m: 520 });
    expect(termsOf(high, { ...mendForm(high), altitude_m: 530 })).toEqual({ absolute_altitude_m: 530 });
  });

  it("waits for its turn: the first one until the vehicle is under control", () => {
    const tasks = ["t1", "t2"].map((id) => ({ id }) as QueuedTask);
    expect([
      mayBeMended(tasks, "t1", true),
      mayBeMended(tasks, "t1", false),
      mayBeMended(tasks, "t2", false),
      mayBeMended(tasks, "t3", true),
    ]).toEqual([true, false, true, false]);
  });
});
