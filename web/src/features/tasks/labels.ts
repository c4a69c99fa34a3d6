/** Tasks and their queue in plain English. Pure. */

import type { QueuedTask, Task, TaskReport, TaskState, WhenEmpty } from "../../api/types";
import type { Tone } from "../../format/labels";
import { age, altitude, distance, heading, seconds, speed } from "../../format/units";
import { isRecord } from "../plan/pointer";
import type { Seen } from "../targets/targets";
import { PLACES, type TaskKind } from "./draft";

type Goto = Extract<Task, { type: "goto" }>;
type Motion = NonNullable<Goto["motion"]>;

const KINDS: Readonly<Record<TaskKind, string>> = { goto: "Go to", circle: "Circle", segment: "Line", path: "Path" };

export function kindName(kind: TaskKind): string {
  return KINDS[kind];
}

/** `feed`: the target that it follows, where that is known. */
export function taskTitle(task: Task, feed: string | null = null): string {
  if (feed !== null) return `Follow ${feed}`;
  switch (task.type) {
    case "goto":
      return gotoTitle(task);
    case "circle":
      return `Circle of ${distance(Math.abs(task.radius_m))}, ${task.radius_m > 0 ? "clockwise" : "counter-clockwise"}`;
    case "segment":
      return "Line";
    case "path":
      return task.points.length === 1 ? "Path to 1 place" : `Path over ${task.points.length} places`;
  }
}

function gotoTitle({ gripper, motion, stay }: Goto): string {
  if (gripper !== null) return gripper === "release" ? "Go to, and release" : "Go to, and grab";
  if (motion !== null) return "Go to a moving target";
  return stay ? "Go to, and stay" : "Go to";
}

/** A task in an event, which leaves out what is null. Null for what is none. */
export function toldTask(data: unknown): Task | null {
  const absent = { relative_altitude_m: null, absolute_altitude_m: null, speed_m_s: null, motion: null, gripper: null };
  return isRecord(data) && typeof data["type"] === "string" && data["type"] in KINDS
    ? ({ ...absent, ...data } as unknown as Task)
    : null;
}

/** How it is flown: what was not given is not said. */
export function taskSummary(task: Task, feed: string | null = null): string {
  const parts = [
    task.relative_altitude_m !== null
      ? `${altitude(task.relative_altitude_m)} above home`
      : task.absolute_altitude_m !== null
        ? `${altitude(task.absolute_altitude_m)} AMSL`
        : "at its altitude",
    task.speed_m_s === null ? "" : speed(task.speed_m_s),
    task.duration_s > 0 ? `for ${seconds(task.duration_s)}` : "",
    task.type === "goto" && task.motion !== null ? motionWords(task.motion, feed !== null) : "",
  ];
  return joined(parts, ", ");
}

/** It ends only when somebody ends it. Others end where they come to. */
function isEndless(task: Task): boolean {
  return (
    task.duration_s <= 0 && (task.type === "circle" || (task.type === "goto" && (task.stay || task.motion !== null)))
  );
}

/** Of a task that never ends by itself, with so many behind it; else nothing. */
export function endlessWords(task: Task, behind: number): string {
  if (!isEndless(task)) return "";
  const waiting = behind === 1 ? "The task behind it waits" : `The ${behind} tasks behind it wait`;
  return behind === 0
    ? "Without limit: it lasts until Next task ends it."
    : `Without limit. ${waiting} until Next task ends it.`;
}

const TARGET_TOLD_S = 5;

/** As it was told last. The service lets it stand when it hears no more of it. */
function motionWords({ north_m_s, east_m_s }: Motion, followed: boolean): string {
  const fast = Math.hypot(north_m_s, east_m_s);
  if (fast < 0.05) return "its target stands now";
  const to = heading(((Math.atan2(east_m_s, north_m_s) * 180) / Math.PI + 360) % 360);
  if (followed) return `its target moves ${speed(fast)} towards ${to}`;
  return `its target moves ${speed(fast)} towards ${to}, and counts as standing ${TARGET_TOLD_S} s after it was told`;
}

/** Of a task that follows a target for this page: how new what it was told is. */
export function followedWords(feed: string, { target, age_s, stale }: Seen): string {
  if (target === null) return `Nothing is known of ${feed} any more: it counts as standing.`;
  return stale
    ? `Nothing was heard of ${feed} for ${age(age_s)}: it counts as standing.`
    : `Heard of ${feed} ${age(age_s)} ago.`;
}

/** What becomes of the vehicle when no task is left. `inRun`: the run that was paused for this. */
export function afterLastWords(whenEmpty: WhenEmpty, vehicle: string, inRun: boolean, isWing: boolean): string {
  if (whenEmpty === "wait")
    return `After the last task ${vehicle} ${isWing ? "circles" : "stands"} and waits for the next.`;
  return inRun
    ? `After the last task control goes back, and the paused run of ${vehicle} goes on.`
    : `After the last task control goes back, and ${vehicle} holds.`;
}

/** Numbers keep their units on the same line. */
function joined(parts: readonly string[], by: string): string {
  return parts
    .filter((part) => part !== "")
    .map((part) => part.replace(/(\d) (?=\w)/g, "$1\u00a0"))
    .join(by);
}

const ON_COURSE_M = 0.5;

/** Of the current task: how long still, how far, and how well it is flown. */
export function progressWords({ cross_m, left_m }: QueuedTask, remaining_s: number): string {
  const parts = [
    remaining_s >= 0 ? `${seconds(Math.ceil(remaining_s))} left` : "",
    left_m === null ? "" : `${distance(Math.round(left_m))} to go`,
    cross_m === null
      ? ""
      : Math.abs(cross_m) < ON_COURSE_M
        ? "on course"
        : `${distance(Math.abs(cross_m))} ${cross_m > 0 ? "right" : "left"} of course`,
  ];
  return joined(parts, " · ");
}

const STATES: Readonly<Record<TaskState, readonly [string, Tone]>> = {
  idle: ["Nothing queued", "neutral"],
  waiting: ["Waits for control", "info"],
  flying: ["Flying", "ok"],
  standing: ["Waits for a task", "info"],
  paused: ["Paused", "warn"],
  manual: ["Manual control", "warn"],
  ending: ["Gives control back", "info"],
};

export function stateName({ state }: TaskReport): string {
  return STATES[state][0];
}

export function stateTone({ state }: TaskReport): Tone {
  return STATES[state][1];
}

/** Instead of a place on the map. */
export function followWords(vehicle: string, feed: string, isHeard: boolean): string {
  return isHeard
    ? `${vehicle} follows ${feed} for its duration, or until you end it. Add it.`
    : `Nothing was heard of ${feed} lately: it cannot be followed now.`;
}

/** What the next click on the map does. */
export function placeWords(kind: TaskKind, places: number, vehicle: string): string {
  const [least, most] = PLACES[kind];
  if (kind === "path")
    return places === 0
      ? "Click the places of the path, up to five."
      : places < most
        ? `${places} of up to ${most} places. Click the next, or add it.`
        : "Five places are the most. Add it.";
  if (places >= least) return "Add it, or click elsewhere.";
  if (kind === "goto") return `Click where ${vehicle} shall go.`;
  if (kind === "circle") return "Click the middle of the circle.";
  return places === 0 ? "Click where the line begins." : "Click where it ends.";
}
