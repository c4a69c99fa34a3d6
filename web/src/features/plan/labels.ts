/** A plan item in a few words, as the lists show it. Pure. */

import type { Timeline } from "../../api/types";
import { altitude, distance, percent, seconds, speed } from "../../format/units";
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
    num(f["relative_altitude_m"], (m) => `${altitude(m)} above home`),
    num(f["absolute_altitude_m"], (m) => `${altitude(m)} above sea level`),
    item.type === "loiter" ? words(f["kind"]) : null,
    num(f["turns"], (n) => `${n} turns`),
    num(f["radius_m"], (m) => `radius ${distance(Math.abs(m))}${m < 0 ? " counter-clockwise" : ""}`),
    num(f["hold_s"], (s) =>
      s > 0 && !dropsMoving ? `hold ${item.type === "waypoint" ? "" : "up to "}${seconds(s)}` : null,
    ),
    num(f["duration_s"], seconds),
    num(f["speed_m_s"], speed),
    num(f["acceptance_radius_m"], (m) => `within ${distance(m)}`),
    num(f["length_m"], distance),
    f["release_motion"] === "stopped" ? "while stopped" : f["release_motion"] === "moving" ? "while moving" : null,
    words(f["mode"]) || null,
    f["consent"] === "operator" ? "with an operator's consent" : null,
    alternateWords(item),
    item.type === "jump" ? `to ${words(f["target"])}` : null,
    num(f["repeats"], (n) => (n === 1 ? "once" : `${n} times`)),
  ];
  return parts.filter((part) => part !== null && part !== "").join(" · ");
}

function alternateWords(item: PlanItemView): string | null {
  const other = alternateOf(item);
  return other === null ? null : `else at ${other.id}`;
}

function num(value: unknown, say: (value: number) => string | null): string | null {
  return typeof value === "number" ? say(value) : null;
}

function words(value: unknown): string {
  return typeof value === "string" ? value.replaceAll("_", " ") : "";
}

// The service's prediction for a plan, as the lists show it. Pure.

/** When an item begins, counted from the start: "+1 min 05 s". An item that is visited again says how often. */
export function arrivalText(timeline: Timeline | null, itemId: string): string {
  const visits = timeline?.entries.filter((entry) => entry.item_id === itemId) ?? [];
  const last = visits.at(-1);
  if (last === undefined) return "";
  return `+${seconds(Math.round(last.end_s))}${visits.length > 1 ? ` (${visits.length} visits)` : ""}`;
}

/**
 * The whole flight: "3 min 20 s · 840 m · 23% of the battery". A wind that nobody told is not in it, and it says so.
 */
export function totalText(timeline: Timeline | null): string {
  if (timeline === null) return "";
  const end = timeline.open_ended ? " until told otherwise" : "";
  const used = timeline.battery_used_percent;
  const battery = used === null ? "" : ` · ${percent(used)} of the battery`;
  const calm = timeline.wind.given ? "" : " · in calm air: wind is not in it";
  return `${seconds(Math.round(timeline.duration_s))}${end} · ${distance(timeline.distance_m)}${battery}${calm}`;
}

/** How a drop is predicted to act: where before the point, how fast, how far the parcel flies on. */
export function dropText(timeline: Timeline | null, itemId: string): string {
  const drop = timeline?.drops.find((predicted) => predicted.item_id === itemId);
  if (!drop) return "";
  const other = timeline?.alternates.find((alternate) => alternate.drop_id === itemId);
  const parts = [
    `${drop.supervised ? "supervised" : "embedded"}, predicted at ${speed(drop.ground_speed_m_s)} and ${altitude(drop.relative_altitude_m)} up`,
    drop.lead_m >= 1 ? `${distance(drop.lead_m)} before the point` : "",
    drop.throw_m >= 1 ? `falls ${seconds(drop.fall_s)}, comes down ${distance(drop.throw_m)} on` : "",
    other
      ? `if it fails on to ${other.item_id}, ${distance(other.distance_m)} and ${seconds(Math.round(other.duration_s))}`
      : "",
  ];
  return parts.filter((part) => part !== "").join(" · ");
}
