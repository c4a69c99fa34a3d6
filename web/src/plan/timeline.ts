/** The service's prediction for a plan, as far as the lists show it. Pure. */

import type { Timeline } from "../api/types";
import { metres, seconds } from "../format/units";

export interface TimelineView {
  readonly duration_s: number | null;
  readonly distance_m: number | null;
  readonly arrivals: ReadonlyMap<string, { readonly at_s: number | null; readonly distance_m: number | null }>;
}

export function viewTimeline(_timeline: Timeline): TimelineView | null {
  return null;
}

export function arrivalText(timeline: TimelineView | null, itemId: string): string {
  const arrival = timeline?.arrivals.get(itemId);
  return arrival && arrival.at_s !== null ? `+${seconds(Math.round(arrival.at_s))}` : "";
}

export function totalText(timeline: TimelineView | null): string {
  if (timeline === null) return "";
  return [seconds(timeline.duration_s), metres(timeline.distance_m)].join(" · ");
}
