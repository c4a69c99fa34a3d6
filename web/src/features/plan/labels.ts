/** A plan item in a few words, as the lists show it. Pure. */

import type { RunState, Timeline } from "../../api/types";
import { runStateLabel } from "../../format/labels";
import { countOf, shortName } from "../../format/text";
import { formatAltitude, formatDistance, formatDuration, formatPercent, formatSpeed } from "../../format/units";
import { alternateOf, type PlanItemView } from "./document";
import { itemType } from "./item-types";

export function itemTitle(item: PlanItemView): string {
  const { title, is_drop } = itemType(item.type);
  const { action, to } = item.fields;
  if (is_drop) return `${title}: ${words(action) || "?"}`;
  if (item.type === "transition") return `${title} to ${words(to) || "?"}`;
  return title;
}

/** Altitude, hold, speed and what else the item says: "30 m above home · hold 5 s". */
export function itemSummary(item: PlanItemView): string {
  const f = item.fields;
  const dropsMoving = f["release_motion"] === "moving"; // then there is no hold, whatever the field's default says
  const parts: (string | null)[] = [
    num(f["relative_altitude_m"], (m) => `${formatAltitude(m)} above home`),
    num(f["absolute_altitude_m"], (m) => `${formatAltitude(m)} above sea level`),
    item.type === "loiter" ? words(f["kind"]) : null,
    num(f["turns"], (n) => `${n} turns`),
    num(f["radius_m"], (m) => `radius ${formatDistance(Math.abs(m))}${m < 0 ? " counter-clockwise" : ""}`),
    num(f["hold_s"], (s) =>
      s > 0 && !dropsMoving ? `hold ${item.type === "waypoint" ? "" : "up to "}${formatDuration(s)}` : null,
    ),
    num(f["duration_s"], formatDuration),
    num(f["speed_m_s"], formatSpeed),
    num(f["acceptance_radius_m"], (m) => `within ${formatDistance(m)}`),
    num(f["length_m"], formatDistance),
    f["release_motion"] === "stopped" ? "while stopped" : f["release_motion"] === "moving" ? "while moving" : null,
    words(f["mode"]) || null,
    f["consent"] === "operator" ? "with operator consent" : null,
    alternateWords(item),
    item.type === "jump" ? `to ${words(f["target"])}` : null,
    num(f["repeats"], (n) => (n === 1 ? "once" : `${n} times`)),
  ];
  return parts.filter((part) => part !== null && part !== "").join(" · ");
}

function alternateWords(item: PlanItemView): string | null {
  const other = alternateOf(item);
  return other === null ? null : `alternate ${other.id}`;
}

function num(value: unknown, say: (value: number) => string | null): string | null {
  return typeof value === "number" ? say(value) : null;
}

function words(value: unknown): string {
  return typeof value === "string" ? value.replaceAll("_", " ") : "";
}

// The service's prediction for a plan, as the lists show it. Pure.

/** When an item begins, counted from the start: "+1 min 05 s". An item that is visited again says how often. */
export function formatArrival(timeline: Timeline | null, itemId: string): string {
  const visits = timeline === null ? undefined : visitsOf(timeline).get(itemId);
  if (visits === undefined) return "";
  const least = timeline?.truncated ? "at least " : "";
  const often = visits.count > 1 ? ` (${least}${visits.count} visits)` : "";
  return `after ${formatDuration(Math.round(visits.end_s))}${often}`;
}

interface Visits {
  readonly count: number;
  /** Of the last one. */
  readonly end_s: number;
}

const visited = new WeakMap<Timeline, ReadonlyMap<string, Visits>>();

/** By item. Worked out once for each timeline: a plan has up to a thousand items, a timeline thousands of visits. */
function visitsOf(timeline: Timeline): ReadonlyMap<string, Visits> {
  const known = visited.get(timeline);
  if (known !== undefined) return known;
  const found = new Map<string, Visits>();
  for (const { item_id, end_s } of timeline.entries)
    found.set(item_id, { count: (found.get(item_id)?.count ?? 0) + 1, end_s });
  visited.set(timeline, found);
  return found;
}

/**
 * The whole flight: "3 min 20 s · 840 m · 23% of the battery". Says so if no wind was given, or if only its first
 * visits are predicted.
 */
export function formatTotal(timeline: Timeline | null): string {
  if (timeline === null) return "";
  const end = timeline.open_ended ? ", open-ended" : "";
  const used = timeline.battery_used_percent;
  const calm = timeline.wind.given ? "" : " · without wind";
  const [more, cut] = timeline.truncated
    ? ["more than ", ` · only the first ${countOf(timeline.entries.length, "visit")} are predicted`]
    : ["", ""];
  const battery = used === null ? "" : ` · ${more}${formatPercent(used)} of the battery`;
  const duration = formatDuration(Math.round(timeline.duration_s));
  return `${more}${duration}${end} · ${more}${formatDistance(timeline.distance_m)}${battery}${calm}${cut}`;
}

/** How a drop is predicted to act: where before the point, how fast, how far the parcel flies on. */
export function formatPredictedDrop(timeline: Timeline | null, itemId: string): string {
  const drop = timeline?.drops.find((predicted) => predicted.item_id === itemId);
  if (!drop) return "";
  const other = timeline?.alternates.find((alternate) => alternate.drop_id === itemId);
  const speed = formatSpeed(drop.ground_speed_m_s);
  const parts = [
    `${drop.supervised ? "supervised" : "embedded"}: ${speed} at ${formatAltitude(drop.relative_altitude_m)}`,
    drop.lead_m >= 1 ? `releases ${formatDistance(drop.lead_m)} before the point` : "",
    drop.throw_m >= 1 ? `falls ${formatDuration(drop.fall_s)}, lands ${formatDistance(drop.throw_m)} further` : "",
    other ? `if it fails: to ${formatAlternate(other)}` : "",
  ];
  return parts.filter((part) => part !== "").join(" · ");
}

function formatAlternate({ item_id, distance_m, duration_s }: Timeline["alternates"][number]): string {
  return `${item_id}, ${formatDistance(distance_m)}, ${formatDuration(Math.round(duration_s))}`;
}

/**
 * What is in the way of an upload, or null: errors of the plan, else a lost link, else the run that the vehicle has.
 */
export function describeUploadObstacle(
  errors: number,
  vehicle: { readonly id: string; readonly connected: boolean } | null,
  run: { readonly vehicle_id: string; readonly state: RunState } | null,
  name: string | null,
): string | null {
  if (errors > 0) return `${countOf(errors, "error")} to mend before the upload.`;
  if (vehicle?.connected === false)
    return `The link to ${vehicle.id} is lost. Upload the plan when the vehicle is heard again.`;
  if (run === null) return null;
  const plan = name === null ? "a run" : `“${shortName(name)}”`;
  const state = runStateLabel(run.state).toLowerCase();
  return `${run.vehicle_id} has ${plan} (${state}). Another plan can follow when that run is over.`;
}
