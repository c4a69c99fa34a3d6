/** How long to wait before the next try to reconnect: doubling, capped, with jitter so that pages do not return in step. */

const FIRST_S = 0.5;
const LONGEST_S = 10;

/** Seconds before try number `attempt` (0 is the first after a loss). `random` is in [0, 1). */
export function backoffSeconds(attempt: number, random: number): number {
  const ceiling = Math.min(LONGEST_S, FIRST_S * 2 ** Math.min(attempt, 10));
  return ceiling * (0.5 + 0.5 * random);
}
