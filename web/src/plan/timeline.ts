/** The service's prediction for a plan, as the lists show it. Pure. */

import type { Timeline } from "../api/types";
import { altitude, distance, percent, seconds, speed } from "../format/units";

/** When an item begins, counted from the start: "+1 min 05 s". An item that is visited again says how often. */
export function arrivalText(timeline: Timeline | null, itemId: string): string {
  const visits = timeline?.entries.filter((entry) => entry.item_id === itemId) ?? [];
  const last = visits.at(-1);
  if (last === undefined) return "";
  return `+${seconds(Math.round(last.end_s))}${visits.length > 1 ? ` (${visits.length} visits)` : ""}`;
}

/** The whole flight: "3 min 20 s · 840 m · 23% of the battery". A wind that nobody told is not in it, and it says so. */
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
    other ? `if it fails on to ${other.item_id}, ${distance(other.distance_m)} and ${seconds(Math.round(other.duration_s))}` : "",
  ];
  return parts.filter((part) => part !== "").join(" · ");
}
