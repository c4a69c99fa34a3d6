/** The moving targets of a run: which drops follow one, where it is by now, and what was last said of it. Pure. */

import type { Reason, StreamEvent, Target, TaskPoint } from "../../api/types";
import { formatReason } from "../../format/reasons";
import { toSentence } from "../../format/text";
import { formatAge, formatDistance, formatDuration, formatHeading, formatSpeed } from "../../format/units";
import { offset, type Point } from "../../geo/geometry";
import type { PlanView } from "../plan/document";
import { isRecord } from "../plan/pointer";

/** A drop whose waypoint follows a target, no farther than `max_move_m` from the planned place. */
export interface TargetFollower {
  readonly dropId: string;
  readonly feed: string;
  readonly planned: Point | null;
  readonly max_move_m: number | null;
}

/** As the service's: an older report is neither followed nor dropped at. */
const STALE_S = 5;

/** A target by now. */
export interface TargetSighting {
  /** Null: nothing was reported yet. */
  readonly target: Target | null;
  readonly age_s: number;
  readonly stale: boolean;
  /** Where it is by now; null if nothing was reported. */
  readonly place: Point | null;
}

/** `after_s`: so long after its report was read. */
export function sightingAfter(target: Target | null, after_s: number): TargetSighting {
  const age_s = target === null ? 0 : target.age_s + after_s;
  return { target, age_s, stale: age_s > STALE_S, place: target === null ? null : positionAfter(target, age_s) };
}

/** Where a task's target is now, and how it moves. */
export interface TargetMotion {
  readonly point: TaskPoint;
  readonly motion: { readonly north_m_s: number; readonly east_m_s: number };
}

/** Null: nothing is known that may be followed. */
export function currentMotion({ target, stale, place }: TargetSighting): TargetMotion | null {
  if (target === null || stale || place === null) return null;
  const { north_m_s, east_m_s } = target.report;
  return { point: { longitude_deg: place[0], latitude_deg: place[1] }, motion: { north_m_s, east_m_s } };
}

/** What became of the newest look: the waypoint was moved to a meeting, or it stays, and why. */
export type TargetUpdate =
  | { readonly kind: "moved"; readonly at: Point; readonly meets_at: number; readonly from_planned_m: number }
  | { readonly kind: "stays"; readonly reason: Reason };

/** A target that the page shows, with the drop that follows it. */
export interface ShownTarget extends TargetSighting {
  /** The drop that follows it; null: none of the chosen run. */
  readonly follower: TargetFollower | null;
  readonly feed: string;
  readonly word: TargetUpdate | null;
}

export function followersOf(plan: PlanView): TargetFollower[] {
  let last: Point | null = null;
  return plan.items.flatMap((item) => {
    last = item.at ?? last;
    const target = item.fields["target"];
    if (item.type !== "gripper" || !isRecord(target) || typeof target["feed"] !== "string") return [];
    const most = target["max_move_m"];
    return [
      {
        dropId: item.id,
        feed: target["feed"],
        planned: pointOf(target["planned"]) ?? last,
        max_move_m: typeof most === "number" ? most : null,
      },
    ];
  });
}

/** Where it is `age_s` after its report, if it keeps its speed and course. */
export function positionAfter({ report }: Target, age_s: number): Point {
  return offset([report.longitude_deg, report.latitude_deg], targetSpeed(report) * age_s, targetCourse(report));
}

function targetSpeed({ north_m_s: north, east_m_s: east }: Target["report"]): number {
  return Math.hypot(north, east);
}

/** Towards where it moves, 0 to 360. */
export function targetCourse({ north_m_s: north, east_m_s: east }: Target["report"]): number {
  return ((Math.atan2(east, north) * 180) / Math.PI + 360) % 360;
}

/** `feed` has the newest event first. */
export function lastUpdate(feed: readonly StreamEvent[], run: string, dropId: string): TargetUpdate | null {
  for (const event of feed) {
    if (event.run_id !== run) continue;
    if (event.kind === "run.target_not_followed" && event.data.plan_item_id === dropId)
      return { kind: "stays", reason: event.data.reason };
    if (event.kind !== "run.target_moved" || event.data.plan_item_id !== dropId) continue;
    const { moved_to: to, after_s, from_planned_m } = event.data;
    return { kind: "moved", at: [to.longitude_deg, to.latitude_deg], meets_at: event.time + after_s, from_planned_m };
  }
  return null;
}

function pointOf(value: unknown): Point | null {
  if (!isRecord(value)) return null;
  const { latitude_deg: lat, longitude_deg: lon } = value;
  return typeof lat === "number" && typeof lon === "number" ? [lon, lat] : null;
}

// A moving target in words: how it moves, how old that is, whether it is followed. Pure.

/** Slower than this it has no course worth a number. */
const STANDS_M_S = 0.05;

export function describeMotion({ target, age_s, stale }: TargetSighting): string {
  if (target === null) return "No report yet.";
  const { report } = target;
  const moves =
    targetSpeed(report) < STANDS_M_S
      ? "Stationary"
      : `Moves at ${formatSpeed(targetSpeed(report))} towards ${formatHeading(targetCourse(report))}`;
  return `${moves}, reported ${formatAge(age_s)} ago${stale ? ": too old to follow or drop at" : ""}.`;
}

/** `now` in Unix seconds; null if the service's time is not known. */
export function describeFollowing({ word }: ShownTarget, now: number | null): string {
  if (word === null) return "The waypoint is at its planned position.";
  if (word.kind === "stays") return toSentence(`The waypoint stays: ${formatReason(word.reason)}`);
  const left_s = now === null ? 0 : Math.round(word.meets_at - now);
  const meeting = left_s > 0 ? `; meeting in ${formatDuration(left_s)}` : "";
  return `The waypoint moved ${formatDistance(word.from_planned_m)} from its planned position${meeting}.`;
}
