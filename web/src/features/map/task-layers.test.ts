import type { Feature } from "geojson";
import { describe, expect, it } from "vitest";
import type { Task, TaskQueue } from "../../api/types";
import { metresBetween, offset, type Point } from "../../geo/geometry";
import { buildTask, DEFAULT_FORM } from "../tasks/draft";
import { globalOf, taskFeatures } from "./task-layers";

const A: Point = [8.55, 47.4];
const ORIGIN = { latitude_deg: 47.4, longitude_deg: 8.55, altitude_m: 488 };

function queueOf(...tasks: (Task | null)[]): TaskQueue {
  const entries = tasks.map((task, i) => ({
    id: `t${i + 1}`,
    task: task as Task,
    remaining_s: -1,
    leg: 0,
    cross_m: null,
    remaining_m: null,
  }));
  return {
    report: { state: "flying", remaining_s: -1, task_list: [], current_id: "t1", reason: null },
    origin: ORIGIN,
    when_empty: "wait",
    control_method: "setpoints",
    capacity: 20,
    tasks: entries,
  };
}

const of = (features: Feature[], kind: string) => features.filter(({ properties }) => properties?.["kind"] === kind);

describe("a queue on the map", () => {
  it("numbers its tasks, the current one first, with the ways between them", () => {
    const queue = queueOf(
      buildTask("goto", [A], DEFAULT_FORM),
      buildTask("segment", [offset(A, 50, 0), offset(A, 90, 0)], DEFAULT_FORM),
    );
    const { features } = taskFeatures(queue, null, []);
    expect(of(features, "number").map(({ properties }) => [properties?.["label"], properties?.["state"]])).toEqual([
      ["1", "current"],
      ["2", "ahead"],
    ]);
    expect(of(features, "way")[0]?.geometry).toEqual({ type: "LineString", coordinates: [A, offset(A, 50, 0)] });
    expect(of(features, "course").length).toBe(1);
  });

  it("draws a circle in the direction in which it is flown", () => {
    const turn = (clockwise: boolean) => {
      const [course] = of(
        taskFeatures(queueOf(buildTask("circle", [A], { ...DEFAULT_FORM, clockwise })), null, []).features,
        "course",
      );
      const ring = course?.geometry.type === "LineString" ? course.geometry.coordinates : [];
      return Math.sign((ring[1]?.[0] ?? 0) - A[0]); // from due north it goes east, or west
    };
    expect([turn(true), turn(false)]).toEqual([1, -1]);
  });

  it("places what counts from the EKF origin, and leaves out what cannot be placed", () => {
    const there = globalOf({ north_m: 30, east_m: -40 }, ORIGIN) as Point;
    expect(metresBetween(A, there)).toBeCloseTo(50, 1);
    expect([there[0] < A[0], there[1] > A[1]]).toEqual([true, true]);
    expect(globalOf({ north_m: 30, east_m: -40 }, null)).toBeNull();
    const local = {
      ...(buildTask("path", [A, A], DEFAULT_FORM) as Extract<Task, { type: "path" }>),
      points: [{ north_m: 1, east_m: 1 }],
    };
    expect(taskFeatures({ ...queueOf(local), origin: null }, null, []).features).toEqual([]);
  });

  it("shows the one that is being added, or its places as long as some are missing", () => {
    const whole = taskFeatures(null, buildTask("circle", [A], DEFAULT_FORM), [A]).features;
    expect(whole.map(({ properties }) => [properties?.["kind"], properties?.["state"]])).toEqual([
      ["course", "draft"],
      ["number", "draft"],
    ]);
    expect(taskFeatures(null, null, [A]).features.map(({ geometry }) => geometry)).toEqual([
      { type: "Point", coordinates: A },
    ]);
  });
});
