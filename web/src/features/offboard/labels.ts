/** What happens at the controls, in words. Pure. */

import type {
  Capability,
  FlightOrder,
  FlownBy,
  Offboard,
  OffboardState,
  TaskMeans,
  VehicleType,
} from "../../api/types";
import { fullSentence } from "../../format/labels";
import { reasonWords } from "../../format/reasons";
import { altitude, climbRate, distance, speed } from "../../format/units";
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
export function givenBackWords(
  why: GivenBack,
  { phase, vehicle }: { readonly phase: string; readonly vehicle: string | null },
): string {
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

/** What a queue without a task leaves to. */
type LeftTo = "mission" | "hold";

/** Nobody asked to leave: no task was left, and control went back. */
const LEFT_ALONE: Readonly<Record<LeftTo, string>> = {
  mission: "no task was left: control went back, and the run goes on",
  hold: "no task was left: control went back, and the vehicle holds",
};

/** Why the service ended it: its own reason if it gave one, after what the page knows. */
export function closeWords(
  code: number,
  reason: string,
  last: { readonly ended: string; readonly offboard: Offboard | null },
): string {
  const lease = code === LEASE_ENDED ? last.offboard?.lease : null;
  const ended = last.offboard?.reason ?? null;
  const alone = ended?.code === "offboard.left" ? LEFT_ALONE[ended.params?.["to"] as LeftTo] : undefined;
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
    return typeof value === "number" && Math.abs(value) >= 0.05
      ? [`${say(Math.abs(value))} ${value > 0 ? plus : minus}`]
      : [];
  });
  const turn = setpoint["yawspeed_deg_s"];
  if (typeof turn === "number" && Math.abs(turn) >= 0.5)
    parts.push(`turn ${Math.abs(turn).toFixed(0)}°/s ${turn > 0 ? "right" : "left"}`);
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

// A vehicle that this page commands and does not fly: how its tasks are flown, and who must be there, in words. Pure.

/** What Waydrop says to it while it flies its tasks. */
export function commandedWords(vehicle: string, by: FlownBy): string {
  const how =
    by === "commands"
      ? `${vehicle} stays in Hold, and Waydrop sends it DO_REPOSITION and DO_ORBIT for its tasks.`
      : `Waydrop streams the setpoints of its tasks to ${vehicle}, in OFFBOARD mode.`;
  return `${how} Keys, sticks and gamepads do nothing, for this page sends no setpoints; Escape leaves to Hold.`;
}

/** While its tasks are flown. */
export function lookAwayWords(vehicle: string, by: FlownBy): string {
  const stop = by === "commands" ? "circles where it is" : "holds";
  return `Keep this page in front of you. If you look away for 10 s, ${vehicle} ${stop} and drops its other tasks.`;
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
  if (by === "commands") return `${vehicle} is in the air. If you take it, it drops its tasks and circles where it is.`;
  return `${vehicle} is in the air. If you take it, it drops its tasks and holds, which ends the lease again.`;
}

/** The newest command to it, as somebody would say it. */
export function orderWords({ command, latitude_deg, altitude_m, radius_m }: FlightOrder): string {
  const height = altitude_m === null ? "" : `, ${altitude(altitude_m)} AMSL`;
  if (command === "DO_ORBIT" && radius_m !== null)
    return `circle of ${distance(Math.abs(radius_m))}, ${radius_m > 0 ? "clockwise" : "counter-clockwise"}${height}`;
  if (command === "DO_REPOSITION") return latitude_deg === null ? "circle where it is" : `fly to a place${height}`;
  return command === "DO_SET_MODE" ? "change the mode" : command;
}

const OUTCOMES: Readonly<Record<Exclude<FlightOrder["outcome"], "acknowledged">, string>> = {
  sent: "no answer yet",
  unanswered: "no answer",
  not_seen: "accepted, not seen",
  not_sent: "not sent",
};

export function resultWords({ outcome, result }: FlightOrder): string {
  if (outcome !== "acknowledged") return OUTCOMES[outcome];
  return result === null ? "an unknown result" : result.toLowerCase().replaceAll("_", " ");
}

// What of this page a vehicle follows as it flies now, by the service's capability table, and why not the rest. Pure.

export interface Ability {
  readonly name: string;
  readonly can: boolean;
  /** Why not, or what it means here; empty if there is nothing to say. */
  readonly why: string;
}

const ATTITUDE =
  "PX4 would follow an attitude, but a wing is lost by one that comes late over a network: no page asks for it.";

const TASKS_BY = {
  commands: "Commanded in Hold (DO_REPOSITION, DO_ORBIT): it follows no setpoint that leads along a line.",
  setpoints: "Waydrop streams the setpoints along each course.",
} as const;

export function abilitiesOf(
  type: VehicleType | null,
  capabilities: readonly Capability[],
  tasks: TaskMeans,
): Ability[] {
  const row = (form: string) => capabilities.find((one) => one.form === form);
  const ability = (name: string, form: string): Ability => {
    const found = row(form);
    return {
      name,
      can: found?.taken === true,
      why: found === undefined || found.taken ? "" : fullSentence(found.reason),
    };
  };
  const abilities = [
    ability("Keys, sticks and gamepad", "velocity_body"),
    ability("Go to a place by a click", "position_global"),
  ];
  abilities.push({
    name: "Tasks",
    can: tasks.flown_by !== null,
    why: tasks.flown_by === null ? sentences(tasks.reason, tasks.hint) : TASKS_BY[tasks.flown_by],
  });
  if (type !== "airship" && row("velocity_body")?.taken === false && row("attitude")?.taken === true)
    abilities.push({ name: "Attitude sticks", can: false, why: ATTITUDE });
  return abilities;
}

function sentences(...texts: readonly string[]): string {
  return texts
    .filter((text) => text !== "")
    .map(fullSentence)
    .join(" ");
}

/** Nothing is to be explained where the page can do all it offers. */
export function isLimited(abilities: readonly Ability[]): boolean {
  return abilities.some(({ can }) => !can);
}
