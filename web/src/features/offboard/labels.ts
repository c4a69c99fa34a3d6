/** Offboard control in words: why it ended, what is sent, what a vehicle accepts. Pure. */

import type {
  Capability,
  ControlMethodName,
  Offboard,
  OffboardExit,
  OffboardState,
  RunState,
  SentCommand,
  SentSetpoint,
  TaskControl,
  VehicleType,
} from "../../api/types";
import { runStateLabel } from "../../format/labels";
import { resultLabel } from "../../format/mavlink";
import { formatReason } from "../../format/reasons";
import { toSentence, toSentences } from "../../format/text";
import { formatAltitude, formatClimbRate, formatDistance, formatSpeed } from "../../format/units";
import type { StopReason } from "./sender";

const STOPS: Readonly<Record<StopReason, string>> = {
  page_hidden: "The page was hidden.",
  window_blurred: "The window lost the focus.",
  focus_lost: "The focus left the controls.",
  page_closed: "The page was closed.",
  no_input: "There was no input for a minute.",
  page_stalled: "The page stalled for more than a second.",
  no_answer: "The service did not answer for more than a second.",
};

export function describeStop(reason: StopReason): string {
  return STOPS[reason];
}

const NOT_FLOWN: Readonly<Partial<Record<RunState, (run: string, vehicle: string) => string>>> = {
  created: (run, vehicle) => `${run} is about to be uploaded to ${vehicle}.`,
  uploading: (run, vehicle) => `${run} is being uploaded to ${vehicle}.`,
  uploaded: (run, vehicle) => `${run} is uploaded to ${vehicle}, but not started.`,
  starting: (run, vehicle) => `${run} is starting on ${vehicle}.`,
};

/** The run that keeps control from beginning. `name` is its plan's. */
export function describeRunInTheWay(vehicle: string, state: RunState, name: string | null): string {
  const run = name === null ? "a run" : `“${name}”`;
  const notFlown = NOT_FLOWN[state]?.(run, vehicle);
  if (notFlown !== undefined) return toSentence(notFlown);
  return `${vehicle} is flying ${run}${state === "flying" ? "" : `: ${runStateLabel(state).toLowerCase()}`}.`;
}

/** `asked`: by the button for it. */
export type ReleaseCause = "asked" | "left_panel" | "other_vehicle";

/** Why this page released a lease, and what became of the vehicle. */
export function describeRelease(
  cause: ReleaseCause,
  { flown, vehicle }: { readonly flown: boolean; readonly vehicle: string | null },
): string {
  const holds = flown ? `; ${vehicle} holds` : "";
  if (cause === "asked") return `You released the lease${holds}.`;
  const left = cause === "left_panel" ? "You left this panel" : "You selected another vehicle";
  return `${left}, which released the lease of ${vehicle}${holds}.`;
}

const LEASE_ENDED = 4410;

const CLOSES: Readonly<Record<number, string>> = {
  1001: "The service is stopping.",
  1006: "The connection was lost.",
  1013: "The service cannot check the token now. Try again in a moment.",
  4401: "A valid token is required.",
  4403: "Only a pilot can use manual control.",
  4404: "This vehicle does not exist.",
};

/** The service ended control because no task was left. */
const ENDED_WITHOUT_TASKS: Readonly<Record<Exclude<OffboardExit, "return">, string>> = {
  mission: "no task was left: control ended, and the run resumed",
  hold: "no task was left: control ended, and the vehicle holds",
};

/** Why the service closed the socket: its own reason if it gave one, after what the page knows. */
export function describeClose(
  code: number,
  reason: string,
  last: { readonly ended: string; readonly offboard: Offboard | null },
): string {
  const lease = code === LEASE_ENDED ? last.offboard?.lease : null;
  const cause = last.offboard?.reason ?? null;
  const tasksEnded =
    cause?.code === "offboard.left"
      ? ENDED_WITHOUT_TASKS[cause.params?.["to"] as keyof typeof ENDED_WITHOUT_TASKS]
      : undefined;
  const known = lease ? `taken over by ${lease.holder}` : (tasksEnded ?? formatReason(cause));
  const why = CLOSES[code] ?? toSentence(known || reason || `closed with code ${code}`);
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

export const SETPOINT_SOURCES: Readonly<Record<SentSetpoint["source"], string>> = {
  client: "from the client",
  dead_man: "by the dead-man switch",
  task: "for a task",
};

const PARTS: readonly (readonly [key: string, plus: string, minus: string])[] = [
  ["forward_m_s", "forward", "back"],
  ["right_m_s", "right", "left"],
  ["north_m_s", "north", "south"],
  ["east_m_s", "east", "west"],
  ["down_m_s", "down", "up"],
];

/** Forms of setpoints that this page never sends keep their own name. */
export function formatSetpoint(setpoint: Readonly<Record<string, unknown>>): string {
  const parts = PARTS.flatMap(([key, plus, minus]) => {
    const value = setpoint[key];
    if (typeof value !== "number" || Math.abs(value) < 0.05) return [];
    const format = key === "down_m_s" ? formatClimbRate : formatSpeed;
    return [`${format(Math.abs(value))} ${value > 0 ? plus : minus}`];
  });
  const turn = setpoint["yawspeed_deg_s"];
  if (typeof turn === "number" && Math.abs(turn) >= 0.5) {
    parts.push(`turn ${Math.abs(turn).toFixed(0)}°/s ${turn > 0 ? "right" : "left"}`);
  }
  if (parts.length > 0) return parts.join(", ");
  const type = String(setpoint["type"]);
  if (type.startsWith("velocity")) return "zero velocity";
  const height = setpoint["altitude_m"];
  if (type === "position_global" && typeof height === "number") return `go to a point, ${formatAltitude(height)} AMSL`;
  return type.replaceAll("_", " ");
}

/** What the dead-man switch does: setpoints arrive, it sends zero velocity, it commanded Hold. */
export type DeadManStage = "active" | "zero_velocity" | "hold";

/** Null while it has nothing to watch. `hasActed`: it ended the last control. */
export function deadManStage(offboard: Offboard | null, hasActed: boolean): DeadManStage | null {
  if (offboard?.state === "idle" && hasActed) return "hold";
  if (offboard === null || offboard.sent === null) return null;
  return offboard.sent.source === "dead_man" ? "zero_velocity" : "active"; // a task sends for its client
}

// Control by tasks alone

export function describeTaskControl(vehicle: string, by: ControlMethodName): string {
  const how =
    by === "commands"
      ? `Waydrop keeps ${vehicle} in Hold and sends it DO_REPOSITION and DO_ORBIT for its tasks.`
      : `Waydrop streams the setpoints of its tasks to ${vehicle} in OFFBOARD mode.`;
  return `${how} Keys, sticks and gamepads have no effect. Escape exits to Hold.`;
}

/** While its tasks are flown. */
export function lookAwayHint(vehicle: string, by: ControlMethodName): string {
  return `Keep this page in view. If you look away for 10 s, ${vehicle} ${stopOf(by)} and discards its other tasks.`;
}

/** What may be lost, and what the vehicle does then while it flies its tasks. */
export function describeLosses(
  vehicle: string,
  by: ControlMethodName,
): readonly (readonly [what: string, then: string])[] {
  const alone =
    by === "commands"
      ? `${vehicle} flies to the last point that it was sent to and circles there. If it circles, it continues.`
      : `The stream ends. The failsafe of ${vehicle} acts as COM_OBL_RC_ACT says.`;
  return [
    ["If you close or reload this page", `${vehicle} ${stopOf(by)} at once and discards its other tasks.`],
    ["If the page is hidden, covered or offline", "The same within 10 s."],
    [`If Waydrop or its link to ${vehicle} fails`, alone],
  ];
}

function stopOf(by: ControlMethodName): string {
  return by === "commands" ? "circles where it is" : "holds";
}

/** For a client that takes the lease of a vehicle under control. */
export function takeOverHint(vehicle: string, by: ControlMethodName): string {
  if (by === "commands")
    return `${vehicle} is in the air. If you take over, it discards its tasks and circles where it is.`;
  return `${vehicle} is in the air. If you take over, it discards its tasks and holds, which ends the lease again.`;
}

export function formatCommand({ command, latitude_deg, altitude_m, radius_m }: SentCommand): string {
  const height = altitude_m === null ? "" : `, ${formatAltitude(altitude_m)} AMSL`;
  if (command === "DO_ORBIT" && radius_m !== null) {
    const direction = radius_m > 0 ? "clockwise" : "counter-clockwise";
    return `circle of ${formatDistance(Math.abs(radius_m))}, ${direction}${height}`;
  }
  if (command === "DO_REPOSITION") return latitude_deg === null ? "circle where it is" : `fly to a point${height}`;
  return command === "DO_SET_MODE" ? "change the mode" : command;
}

const COMMAND_OUTCOMES: Readonly<Record<Exclude<SentCommand["outcome"], "acknowledged">, string>> = {
  sent: "no answer yet",
  unanswered: "no answer",
  not_seen: "accepted, but no change observed",
  not_sent: "not sent",
};

export function formatCommandResult({ outcome, result }: SentCommand): string {
  return outcome === "acknowledged" ? resultLabel(result) : COMMAND_OUTCOMES[outcome];
}

// What a vehicle accepts

interface CapabilitySummary {
  readonly name: string;
  readonly can: boolean;
  /** Why not, or how it works; empty if there is nothing to say. */
  readonly why: string;
}

const ATTITUDE =
  "PX4 accepts attitude setpoints, but a network may delay them too much for a wing. This page does not send them.";

const TASK_CONTROL: Readonly<Record<ControlMethodName, string>> = {
  commands: "Sent as commands in Hold (DO_REPOSITION, DO_ORBIT): it follows no setpoints along a line.",
  setpoints: "Waydrop streams the setpoints along each course.",
};

/** What this page can do with a vehicle as it flies now, by the service's capability table. */
export function summarizeCapabilities(
  type: VehicleType | null,
  capabilities: readonly Capability[],
  tasks: TaskControl,
): CapabilitySummary[] {
  const row = (form: string) => capabilities.find((one) => one.form === form);
  const summary = (name: string, form: string): CapabilitySummary => {
    const found = row(form);
    const can = found?.accepted === true;
    return { name, can, why: found === undefined || can ? "" : toSentence(found.reason) };
  };
  const by = tasks.control_method;
  const summaries = [
    summary("Keys, sticks and gamepad", "velocity_body"),
    summary("Go to a point on the map", "position_global"),
    { name: "Tasks", can: by !== null, why: by === null ? toSentences(tasks.reason, tasks.hint) : TASK_CONTROL[by] },
  ];
  const hasAttitudeOnly = row("velocity_body")?.accepted === false && row("attitude")?.accepted === true;
  if (type === "airship" || !hasAttitudeOnly) return summaries;
  return [...summaries, { name: "Attitude sticks", can: false, why: ATTITUDE }];
}

/** Some of what the page offers does not work with this vehicle. */
export function isLimited(summaries: readonly CapabilitySummary[]): boolean {
  return summaries.some(({ can }) => !can);
}
