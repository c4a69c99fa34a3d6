import { describe, expect, it } from "vitest";
import type { QueuedTask, Task } from "../../api/types";
import { metresBetween, offset, type Point } from "../../geo/geometry";
import { currentMotion, sightingAfter } from "../targets/targets";
import { addPoint, buildTask, DEFAULT_FORM, isComplete } from "./draft";
import {
  afterLastHint,
  describeReportAge,
  endlessHint,
  followHint,
  formatProgress,
  nextPointHint,
  readEventTask,
  taskSummary,
  taskTitle,
} from "./labels";
import { decodeDrag, encodeDrag, moveOnto } from "./order";

const A: Point = [8.55, 47.4];
const B = offset(A, 50, 90);
const at = ([longitude_deg, latitude_deg]: Point) => ({ latitude_deg, longitude_deg });
const spaced = (text: string) => text.replaceAll("\u00a0", " ");

describe("a task that is put together", () => {
  it("is nothing before it has its places", () => {
    expect(buildTask("goto", [], DEFAULT_FORM)).toBeNull();
    expect(buildTask("segment", [A], DEFAULT_FORM)).toBeNull();
    expect(buildTask("circle", [A], { ...DEFAULT_FORM, radius_m: null })).toBeNull();
    expect([isComplete("path", []), isComplete("path", [A])]).toEqual([false, true]);
  });

  it("follows a target instead of a place and does nothing else there; without a known target it is nothing", () => {
    const target = { point: at(A), motion: { north_m_s: 1, east_m_s: 0 } };
    const form = { ...DEFAULT_FORM, follow: "ship-1", duration_s: 60 };
    expect(buildTask("goto", [], form, target)).toMatchObject({
      ...target,
      stay: false,
      gripper: null,
      duration_s: 60,
    });
    expect(buildTask("goto", [B], form, null)).toBeNull();
    expect(buildTask("path", [B], form, null)?.type).toBe("path");
  });

  it("says nothing that was not given: null, and no limit", () => {
    expect(buildTask("segment", [A, B], DEFAULT_FORM)).toEqual({
      type: "segment",
      start: at(A),
      end: at(B),
      relative_altitude_m: null,
      absolute_altitude_m: null,
      speed_m_s: null,
      duration_s: -1,
    });
  });

  it("turns the direction of a circle into the sign of its radius", () => {
    expect(buildTask("circle", [A], DEFAULT_FORM)).toMatchObject({ center: at(A), radius_m: 20 });
    expect(buildTask("circle", [A], { ...DEFAULT_FORM, clockwise: false, duration_s: 30 })).toMatchObject({
      radius_m: -20,
      duration_s: 30,
    });
  });

  it("goes on, stays, or works the gripper, and never two of them", () => {
    expect(buildTask("goto", [A], { ...DEFAULT_FORM, stay: true, gripper: "release" })).toMatchObject({
      gripper: "release",
      stay: false,
    });
    expect(buildTask("goto", [A], { ...DEFAULT_FORM, stay: true })).toMatchObject({ gripper: null, stay: true });
  });

  it("takes as many places as its kind has; another click moves the last", () => {
    expect(addPoint("goto", [A], B)).toEqual([B]);
    expect(addPoint("segment", [A, B], A)).toEqual([A, A]);
    const five = [10, 20, 30, 40, 50].reduce<readonly Point[]>(
      (places, metres) => addPoint("path", places, offset(A, metres, 0)),
      [],
    );
    expect(five.length).toBe(5);
    expect(addPoint("path", five, B).at(-1)).toEqual(B);
    expect(addPoint("path", five, B).length).toBe(5);
  });

  it("takes a double click for one place", () => {
    const near = offset(B, 0.1, 0);
    expect(metresBetween(near, B)).toBeLessThan(0.2);
    expect(addPoint("path", [A, B], near)).toEqual([A, B]);
  });
});

describe("a task's new place in the queue", () => {
  const ids = ["t1", "t2", "t3", "t4"];

  it("is said by the one that comes after it", () => {
    const beforeOf = (task: string, onto: string) => moveOnto(ids, task, onto)?.before;
    expect([
      beforeOf("t3", "t1"),
      beforeOf("t1", "t2"),
      beforeOf("t2", "t3"),
      beforeOf("t2", "t4"),
      beforeOf("t4", "t3"),
    ]).toEqual(["t1", "t3", "t4", null, "t3"]);
    expect(moveOnto(ids, "t2", "t2")).toBeNull();
  });

  it("is that of the task it is dropped on, though the current one ended meanwhile", () => {
    expect(moveOnto(ids.slice(1), "t4", "t3")).toEqual({ task_id: "t4", before: "t3" });
    expect([moveOnto(ids.slice(1), "t1", "t3"), moveOnto(ids.slice(1), "t4", "t1")]).toEqual([null, null]);
  });

  it("is carried with the vehicle whose task it is", () => {
    const dragged = { vehicle: "v1", task_id: "t3" };
    expect(decodeDrag(encodeDrag(dragged))).toEqual(dragged);
    for (const text of ["", "2", "null", "{}", '{"vehicle":"v1","task_id":3}']) expect(decodeDrag(text)).toBeNull();
  });
});

describe("in words", () => {
  const circle = buildTask("circle", [A], {
    ...DEFAULT_FORM,
    clockwise: false,
    altitude_m: 25,
    duration_s: 90,
  }) as Task;
  const entry = (fields: Partial<QueuedTask>): QueuedTask => ({
    id: "t1",
    task: circle,
    remaining_s: -1,
    leg: 0,
    cross_m: null,
    remaining_m: null,
    ...fields,
  });

  it("a task says what it is and how it is flown", () => {
    expect(taskTitle(circle)).toBe("Circle, radius 20 m, counter-clockwise");
    expect(spaced(taskSummary(circle))).toBe("25 m above home, for 1 min 30 s");
    expect(taskTitle(buildTask("goto", [A], { ...DEFAULT_FORM, gripper: "release" }) as Task)).toBe(
      "Go to and release",
    );
    expect(taskSummary(buildTask("path", [A], DEFAULT_FORM) as Task)).toBe("at its altitude");
  });

  it("an event says of it all but what is null", () => {
    const { relative_altitude_m: _, absolute_altitude_m: __, speed_m_s: ___, ...told } = circle;
    expect(readEventTask({ ...told, relative_altitude_m: 25 })).toMatchObject(circle);
    expect([readEventTask(null), readEventTask({ type: "dance" })]).toEqual([null, null]);
  });

  it("the current one says how long, how far and how well, as far as it is known", () => {
    expect(spaced(formatProgress(entry({ cross_m: -3.2, remaining_m: 41.6 }), 12.3))).toBe(
      "13 s left · 42 m to go · 3.2 m left of course",
    );
    expect(formatProgress(entry({ cross_m: 0.2 }), -1)).toBe("on course");
    expect(formatProgress(entry({}), -1)).toBe("");
  });

  it("a moving target is told with where it goes, and that it is assumed stationary without reports", () => {
    const target = {
      ...(buildTask("goto", [A], DEFAULT_FORM) as Extract<Task, { type: "goto" }>),
      motion: { north_m_s: 1.5, east_m_s: -1.5 },
    };
    expect(taskTitle(target)).toBe("Go to a moving target");
    expect(spaced(taskSummary(target))).toBe(
      "at its altitude, target moves at 2.1 m/s towards 315°, assumed stationary 5 s after its report",
    );
    expect(taskSummary({ ...target, motion: { north_m_s: 0, east_m_s: 0 } })).toContain("target is stationary");
  });

  it("what follows a target says which, and how new the word of it is", () => {
    const target = {
      ...(buildTask("goto", [A], DEFAULT_FORM) as Extract<Task, { type: "goto" }>),
      motion: { north_m_s: 2, east_m_s: 0 },
    };
    expect([taskTitle(target, "ship-1"), spaced(taskSummary(target, "ship-1"))]).toEqual([
      "Follow ship-1",
      "at its altitude, target moves at 2.0 m/s towards 000°",
    ]);
    const report = { latitude_deg: 47.4, longitude_deg: 8.55, north_m_s: 2, east_m_s: 0, time: 1000 };
    const seen = (after_s: number) => sightingAfter({ feed: "ship-1", report, age_s: 0.4, stale: false }, after_s);
    expect([describeReportAge("ship-1", seen(1)), describeReportAge("ship-1", seen(12))]).toEqual([
      "Last report from ship-1 1.4 s ago.",
      "No report from ship-1 for 12 s: assumed stationary.",
    ]);
    expect([currentMotion(seen(1))?.motion, currentMotion(seen(12)), currentMotion(sightingAfter(null, 0))]).toEqual([
      { north_m_s: 2, east_m_s: 0 },
      null,
      null,
    ]);
    expect(
      [followHint("v1", "ship-1", true), followHint("v1", "ship-1", false)].map((words) => words.includes("cannot")),
    ).toEqual([false, true]);
  });

  it("a task that never ends by itself says so, and what waits for its end", () => {
    const circle = buildTask("circle", [A], DEFAULT_FORM) as Task;
    expect([0, 1, 3].map((behind) => endlessHint(circle, behind))).toEqual([
      "No time limit: it continues until you press Next task.",
      "No time limit. The task behind it waits until you press Next task.",
      "No time limit. The 3 tasks behind it wait until you press Next task.",
    ]);
    const goto = buildTask("goto", [A], DEFAULT_FORM) as Extract<Task, { type: "goto" }>;
    const endless = [circle, { ...goto, stay: true }, { ...goto, motion: { north_m_s: 1, east_m_s: 0 } }];
    const ending = [
      { ...circle, duration_s: 30 },
      { ...goto, stay: true, duration_s: 5 },
      goto,
      buildTask("segment", [A, B], DEFAULT_FORM) as Task,
      buildTask("path", [A, B], DEFAULT_FORM) as Task,
    ];
    expect([...endless, ...ending].map((task) => endlessHint(task, 1) !== "")).toEqual([
      true,
      true,
      true,
      false,
      false,
      false,
      false,
      false,
    ]);
  });

  it("what comes after the last task is told", () => {
    expect(afterLastHint("wait", "v1", true, false)).toBe("After the last task, v1 stops and waits for the next.");
    expect(afterLastHint("wait", "v3", false, true)).toContain("circles");
    expect(afterLastHint("plan", "v1", true, false)).toContain("resumes its paused run");
    expect(afterLastHint("plan", "v1", false, false)).toContain("v1 holds");
  });

  it("the next click is told", () => {
    expect(nextPointHint("goto", 0, "v1")).toBe("Click where v1 should go.");
    expect(nextPointHint("segment", 1, "v1")).toBe("Click where the line ends.");
    expect(nextPointHint("path", 5, "v1")).toContain("maximum");
  });
});
