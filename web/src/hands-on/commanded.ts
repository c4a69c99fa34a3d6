/** A vehicle that this page commands and does not fly: how its tasks are flown, and who must be there, in words. Pure. */

import type { FlightOrder, FlownBy } from "../api/types";
import { altitude, distance } from "../format/units";

/** What Waydrop says to it while it flies its tasks. */
export function commandedWords(vehicle: string, by: FlownBy): string {
  const how = by === "commands" ? `${vehicle} stays in Hold, and Waydrop sends it DO_REPOSITION and DO_ORBIT for its tasks.` : `Waydrop streams the setpoints of its tasks to ${vehicle}, in OFFBOARD mode.`;
  return `${how} Keys, sticks and gamepads do nothing, for this page sends no setpoints; Escape leaves to Hold.`;
}

/** While its tasks are flown. */
export function lookAwayWords(vehicle: string, by: FlownBy): string {
  return `Flown while this page is in front of you. Look away for 10 s, and ${vehicle} ${by === "commands" ? "circles where it is" : "holds"} and drops the rest.`;
}

/** Who goes away, and what then becomes of a vehicle that flies its tasks. */
export function goneWords(vehicle: string, by: FlownBy): readonly (readonly [who: string, what: string])[] {
  const stops = by === "commands" ? "is told to circle where it is" : "is told to hold";
  const alone =
    by === "commands"
      ? `Nothing is sent any more: ${vehicle} flies on to the place it was last sent to and circles there, and a circle goes on.`
      : `The stream ends: ${vehicle}’s own failsafe acts, as COM_OBL_RC_ACT says.`;
  return [
    ["This page is closed or loaded anew", `${vehicle} ${stops} at once, and the rest of its tasks is dropped.`],
    ["It is hidden, behind another window or without a connection", "The same within 10 s."],
    [`Waydrop or its link to ${vehicle} dies`, alone],
  ];
}

/** Whoever takes the lease of one that is under control already. */
export function takeOverWords(vehicle: string, by: FlownBy): string {
  if (by === "commands") return `${vehicle} is in the air: its tasks are dropped when you take it, and it circles where it is until you queue others.`;
  return `${vehicle} is in the air: its tasks are dropped when you take it, and without a task it is told to hold, which ends the lease. Then take it anew.`;
}

/** The newest command to it, as somebody would say it. */
export function orderWords({ command, latitude_deg, altitude_m, radius_m }: FlightOrder): string {
  const height = altitude_m === null ? "" : `, ${altitude(altitude_m)} AMSL`;
  if (command === "DO_ORBIT" && radius_m !== null) return `circle of ${distance(Math.abs(radius_m))}, ${radius_m > 0 ? "clockwise" : "counter-clockwise"}${height}`;
  if (command === "DO_REPOSITION") return latitude_deg === null ? "circle where it is" : `fly to a place${height}`;
  return command === "DO_SET_MODE" ? "change the mode" : command;
}

const RESULTS: Readonly<Record<string, string>> = { sent: "no answer yet", ACCEPTED: "accepted" };

export function resultWords({ result }: FlightOrder): string {
  return RESULTS[result] ?? result.toLowerCase().replaceAll("_", " ");
}
