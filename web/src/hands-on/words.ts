/** What happens at the controls, in words. Pure. */

import type { Offboard, OffboardState } from "../api/types";
import { reasonWords } from "../format/reasons";
import { altitude, climbRate, speed } from "../format/units";
import { fullSentence } from "../format/words";
import type { StopReason } from "./sender";

const STOPS: Readonly<Record<StopReason, string>> = {
  hidden: "The page was hidden.",
  window_left: "The window lost the focus.",
  focus_left: "The focus left the controls.",
  page_closed: "The page was closed.",
  nobody: "Nobody touched a control for a minute.",
  stood_still: "The page stood still for more than a second.",
  no_answer: "The service did not answer for more than a second.",
};

export function stopWords(reason: StopReason): string {
  return STOPS[reason];
}

/** `asked`: by the button for it. */
export type GivenBack = "asked" | "left_view" | "other_vehicle";

/** Why this page gave a lease back by itself, and what became of the vehicle. */
export function givenBackWords(why: GivenBack, { phase, vehicle }: { readonly phase: string; readonly vehicle: string | null }): string {
  const held = FLOWN.has(phase) ? `, and ${vehicle} was told to hold` : "";
  if (why === "asked") return `The lease was given back${held}.`;
  const left = why === "left_view" ? "You left this view" : "You chose another vehicle";
  return `${left}: the lease of ${vehicle} was given back${held}.`;
}

const FLOWN: ReadonlySet<string> = new Set(["entering", "flying", "leaving"]);

const LEASE_ENDED = 4410;

const CLOSES: Readonly<Record<number, string>> = {
  1001: "The service stops.",
  1006: "The connection was lost.",
  1013: "The service cannot look at the token now; try again in a moment.",
  4401: "A valid token is needed.",
  4403: "Only a pilot may use manual control.",
  4404: "There is no such vehicle.",
};

/** Nobody asked to leave: no task was left, and control went back. */
const LEFT_ALONE: Readonly<Record<string, string>> = {
  mission: "no task was left: control went back, and the run goes on",
  hold: "no task was left: control went back, and the vehicle holds",
};

/** Why the service ended it: its own reason if it gave one, after what the page knows. */
export function closeWords(code: number, reason: string, last: { readonly ended: string; readonly offboard: Offboard | null }): string {
  const lease = code === LEASE_ENDED ? last.offboard?.lease : null;
  const ended = last.offboard?.reason ?? null;
  const alone = ended?.code === "offboard.left" ? LEFT_ALONE[String(ended.params?.["to"])] : undefined;
  const given = lease ? `taken over by ${lease.holder}` : (alone ?? reasonWords(ended));
  const why = CLOSES[code] ?? fullSentence(given || reason || `closed with ${code}`);
  return `${last.ended} ${why}`.trim();
}

/** The steps of an entry, in order. */
export const ENTRY_STEPS: readonly (readonly [OffboardState, string])[] = [
  ["checking", "Check"],
  ["holding", "Hold"],
  ["streaming", "Stream"],
  ["switching", "Switch"],
  ["active", "Manual control on"],
];

const PARTS: readonly (readonly [key: string, plus: string, minus: string])[] = [
  ["forward_m_s", "forward", "back"],
  ["right_m_s", "right", "left"],
  ["north_m_s", "north", "south"],
  ["east_m_s", "east", "west"],
  ["down_m_s", "down", "up"],
];

/** A setpoint as somebody would say it. Forms that this page never sends keep their own name. */
export function setpointWords(setpoint: Readonly<Record<string, unknown>>): string {
  const parts = PARTS.flatMap(([key, plus, minus]) => {
    const value = setpoint[key];
    const say = key === "down_m_s" ? climbRate : speed;
    return typeof value === "number" && Math.abs(value) >= 0.05 ? [`${say(Math.abs(value))} ${value > 0 ? plus : minus}`] : [];
  });
  const turn = setpoint["yawspeed_deg_s"];
  if (typeof turn === "number" && Math.abs(turn) >= 0.5) parts.push(`turn ${Math.abs(turn).toFixed(0)}°/s ${turn > 0 ? "right" : "left"}`);
  if (parts.length > 0) return parts.join(", ");
  const type = String(setpoint["type"]);
  if (type.startsWith("velocity")) return "stand still";
  const height = setpoint["altitude_m"];
  if (type === "position_global" && typeof height === "number") return `go to a place, ${altitude(height)} AMSL`;
  return type === "position_ned" ? "be at a place" : type.replaceAll("_", " ");
}

export type Stage = "speaks" | "silent" | "gone";

/** Where the dead-man is; null while it has nothing to watch. `fellSilent`: the last one was ended by it. */
export function stageOf(offboard: Offboard | null, fellSilent: boolean): Stage | null {
  if (offboard?.state === "idle" && fellSilent) return "gone";
  if (offboard === null || offboard.sent === null) return null;
  return offboard.sent.source === "dead_man" ? "silent" : "speaks"; // a task speaks for its client
}
