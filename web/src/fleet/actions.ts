import type { Vehicle } from "../api/types";

export type Action = "hold" | "return" | "land";

const ARMED: readonly Action[] = ["hold", "return", "land"];
const READY: readonly string[] = ["hold", "mission"];

/** What a vehicle without a run can be told: disarmed only to hold, which takes it out of a mode in which it does not arm. */
export function actionsOf({ armed, mode }: Pick<Vehicle["state"], "armed" | "mode">): readonly Action[] {
  if (armed === true) return ARMED;
  return armed === false && mode !== null && !READY.includes(mode) ? ["hold"] : [];
}
