/** What of this page a vehicle follows as it flies now, by the service's capability table, and why not the rest. Pure. */

import type { Capability, TaskMeans, VehicleType } from "../api/types";
import { fullSentence } from "../format/words";

export interface Ability {
  readonly name: string;
  readonly can: boolean;
  /** Why not, or what it means here; empty if there is nothing to say. */
  readonly why: string;
}

const ATTITUDE = "PX4 would follow an attitude, but a wing is lost by one that comes late over a network: no page asks for it.";

const TASKS_BY = {
  commands: "Commanded in Hold (DO_REPOSITION, DO_ORBIT): it follows no setpoint that leads along a line.",
  setpoints: "Waydrop streams the setpoints along each course.",
} as const;

export function abilitiesOf(type: VehicleType | null, capabilities: readonly Capability[], tasks: TaskMeans): Ability[] {
  const row = (form: string) => capabilities.find((one) => one.form === form);
  const ability = (name: string, form: string): Ability => {
    const found = row(form);
    return { name, can: found?.taken === true, why: found === undefined || found.taken ? "" : fullSentence(found.reason) };
  };
  const abilities = [ability("Keys, sticks and gamepad", "velocity_body"), ability("Go to a place by a click", "position_global")];
  abilities.push({ name: "Tasks", can: tasks.flown_by !== null, why: tasks.flown_by === null ? sentences(tasks.reason, tasks.hint) : TASKS_BY[tasks.flown_by] });
  if (type !== "airship" && row("velocity_body")?.taken === false && row("attitude")?.taken === true) abilities.push({ name: "Attitude sticks", can: false, why: ATTITUDE });
  return abilities;
}

function sentences(...texts: readonly string[]): string {
  return texts.filter((text) => text !== "").map(fullSentence).join(" ");
}

/** Nothing is to be explained where the page can do all it offers. */
export function isLimited(abilities: readonly Ability[]): boolean {
  return abilities.some(({ can }) => !can);
}
