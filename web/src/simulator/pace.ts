/** The speed of simulated time in words. Pure. */

import type { SimulatorSpeed } from "../api/types";

/** What is offered: up to 4 for all, above for embedded missions. The API takes all between. */
export const SPEEDS: readonly number[] = [1, 2, 4, 10, 20, 50];

export function paceWords({ wanted, achieved, behind, live, live_max: most }: SimulatorSpeed): string {
  const runs = wanted === 1 ? "Time runs as ours." : `Time runs ${times(wanted)} as fast as ours.`;
  const slow = behind && achieved !== null ? ` This machine keeps only ${times(achieved)}: the vehicles fly the same, later.` : "";
  const cap = live ? ` Above ${times(most)}, supervised drops and offboard control are refused.` : ` Supervised drops and offboard control are refused above ${times(most)}: only embedded missions fly now.`;
  return runs + slow + cap;
}

function times(factor: number): string {
  return `${Number(factor.toFixed(1))}×`;
}
