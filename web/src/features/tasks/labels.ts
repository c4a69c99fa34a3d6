/** Tasks and their queue in words. Pure. */

import type { QueuedTask, Task, TaskReport, TaskState, WhenEmpty } from "../../api/types";
import type { Tone } from "../../format/labels";
import {
  formatAge,
  formatAltitude,
  formatDistance,
  formatDuration,
  formatHeading,
  formatSpeed,
} from "../../format/units";
import { isRecord } from "../plan/pointer";
import type { TargetSighting } from "../targets/targets";
import { POINT_COUNTS, type TaskKind } from "./draft";

type Goto = Extract<Task, { type: "goto" }>;
type Motion = NonNullable<Goto["motion"]>;

const KINDS: Readonly<Record<TaskKind, string>> = { goto: "Go to", circle: "Circle", segment: "Line", path: "Path" };

export function taskKindLabel(kind: TaskKind): string {
  return KINDS[kind];
}

/** `feed`: the target that it follows; null if it follows none, or that is unknown. */
export function taskTitle(task: Task, feed: string | null = null): string {
  if (feed !== null) return `Follow ${feed}`;
  switch (task.type) {
    case "goto":
      return gotoTitle(task);
    case "circle": {
      const direction = task.radius_m > 0 ? "clockwise" : "counter-clockwise";
      return `Circle, radius ${formatDistance(Math.abs(task.radius_m))}, ${direction}`;
    }
    case "segment":
      return "Line";
    case "path":
      return task.points.length === 1 ? "Path with 1 point" : `Path with ${task.points.length} points`;
  }
}

function gotoTitle({ gripper, motion, stay }: Goto): string {
  if (gripper !== null) return gripper === "release" ? "Go to and release" : "Go to and grab";
  if (motion !== null) return "Go to a moving target";
  return stay ? "Go to and stay" : "Go to";
}

/** A task from an event, which leaves out what is null. Null if it is no task. */
export function readEventTask(data: unknown): Task | null {
  const absent = { relative_altitude_m: null, absolute_altitude_m: null, speed_m_s: null, motion: null, gripper: null };
  return isRecord(data) && typeof data["type"] === "string" && data["type"] in KINDS
    ? ({ ...absent, ...data } as unknown as Task)
    : null;
}

/** How it is flown; leaves out what is not given. */
export function taskSummary(task: Task, feed: string | null = null): string {
  const parts = [
    altitudeOf(task),
    task.speed_m_s === null ? "" : formatSpeed(task.speed_m_s),
    task.duration_s > 0 ? `for ${formatDuration(task.duration_s)}` : "",
    task.type === "goto" && task.motion !== null ? formatMotion(task.motion, feed !== null) : "",
  ];
  return joinUnbroken(parts, ", ");
}

function altitudeOf({ relative_altitude_m, absolute_altitude_m }: Task): string {
  if (relative_altitude_m !== null) return `${formatAltitude(relative_altitude_m)} above home`;
  return absolute_altitude_m === null ? "at its altitude" : `${formatAltitude(absolute_altitude_m)} AMSL`;
}

const STATIONARY_AFTER_S = 5;

/** As last reported. The service assumes that a target stands still when its reports end. */
function formatMotion({ north_m_s, east_m_s }: Motion, followed: boolean): string {
  const speed_m_s = Math.hypot(north_m_s, east_m_s);
  if (speed_m_s < 0.05) return "target is stationary";
  const course = formatHeading(((Math.atan2(east_m_s, north_m_s) * 180) / Math.PI + 360) % 360);
  const moves = `target moves at ${formatSpeed(speed_m_s)} towards ${course}`;
  return followed ? moves : `${moves}, assumed stationary ${STATIONARY_AFTER_S} s after its report`;
}

/** Some tasks end only when the pilot ends them; the others end at their last point. */
function isEndless(task: Task): boolean {
  if (task.duration_s > 0) return false;
  return task.type === "circle" || (task.type === "goto" && (task.stay || task.motion !== null));
}

/** For a task that never ends by itself, with so many tasks behind it; else empty. */
export function endlessHint(task: Task, behind: number): string {
  if (!isEndless(task)) return "";
  if (behind === 0) return "No time limit: it continues until you press Next task.";
  const waiting = behind === 1 ? "The task behind it waits" : `The ${behind} tasks behind it wait`;
  return `No time limit. ${waiting} until you press Next task.`;
}

/** For a task that follows a target: how old its last report is. */
export function describeReportAge(feed: string, { target, age_s, stale }: TargetSighting): string {
  if (target === null) return `No report from ${feed}: assumed stationary.`;
  return stale
    ? `No report from ${feed} for ${formatAge(age_s)}: assumed stationary.`
    : `Last report from ${feed} ${formatAge(age_s)} ago.`;
}

/** What the vehicle does when no task is left. `inRun`: a run was paused for the tasks. */
export function afterLastHint(whenEmpty: WhenEmpty, vehicle: string, inRun: boolean, isWing: boolean): string {
  const after = "After the last task";
  if (whenEmpty === "wait") return `${after}, ${vehicle} ${isWing ? "circles" : "stops"} and waits for the next.`;
  return inRun
    ? `${after}, control ends and ${vehicle} resumes its paused run.`
    : `${after}, control ends and ${vehicle} holds.`;
}

/** Numbers keep their units on the same line. */
function joinUnbroken(parts: readonly string[], separator: string): string {
  return parts
    .filter((part) => part !== "")
    .map((part) => part.replace(/(\d) (?=\w)/g, "$1\u00a0"))
    .join(separator);
}

const ON_COURSE_M = 0.5;

/** Of the current task: time left, distance left, and how far it is off its course. */
export function formatProgress({ cross_m, remaining_m }: QueuedTask, remaining_s: number): string {
  const parts = [
    remaining_s >= 0 ? `${formatDuration(Math.ceil(remaining_s))} left` : "",
    remaining_m === null ? "" : `${formatDistance(Math.round(remaining_m))} to go`,
    cross_m === null ? "" : formatCrossTrack(cross_m),
  ];
  return joinUnbroken(parts, " · ");
}

function formatCrossTrack(cross_m: number): string {
  if (Math.abs(cross_m) < ON_COURSE_M) return "on course";
  return `${formatDistance(Math.abs(cross_m))} ${cross_m > 0 ? "right" : "left"} of course`;
}

const STATES: Readonly<Record<TaskState, readonly [string, Tone]>> = {
  idle: ["Empty", "neutral"],
  waiting: ["Waiting for control", "info"],
  flying: ["Flying", "info"],
  standing: ["Waiting for a task", "info"],
  paused: ["Paused", "warn"],
  manual: ["Manual control", "warn"],
  ending: ["Ending", "info"],
};

export function queueStateLabel({ state }: TaskReport): string {
  return STATES[state][0];
}

export function queueStateTone({ state }: TaskReport): Tone {
  return STATES[state][1];
}

/** For a task that follows a target instead of going to a point. */
export function followHint(vehicle: string, feed: string, hasReported: boolean): string {
  return hasReported
    ? `${vehicle} follows ${feed} for the duration, or until you end it. Add the task.`
    : `${feed} has not reported lately, so ${vehicle} cannot follow it now. Wait for a report, or choose a point.`;
}

/** What the next click on the map does. */
export function nextPointHint(kind: TaskKind, count: number, vehicle: string): string {
  const [least, most] = POINT_COUNTS[kind];
  switch (kind) {
    case "path":
      if (count === 0) return "Click the points of the path, up to five.";
      return count < most
        ? `${count} of up to ${most} points. Click the next, or add the task.`
        : "Five points are the maximum. Add the task.";
    case "goto":
      return count < least ? `Click where ${vehicle} should go.` : ADD_OR_MOVE;
    case "circle":
      return count < least ? "Click the centre of the circle." : ADD_OR_MOVE;
    case "segment":
      if (count === 0) return "Click where the line begins.";
      return count < least ? "Click where the line ends." : ADD_OR_MOVE;
  }
}

const ADD_OR_MOVE = "Add the task, or click another point.";
