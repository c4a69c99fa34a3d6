/** A plan item in a few words, as the lists show it. Pure. */

import { altitude, distance, seconds, speed } from "../format/units";
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
    num(f["hold_s"], (s) => (s > 0 && !dropsMoving ? `hold ${item.type === "waypoint" ? "" : "up to "}${seconds(s)}` : null)),
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
