import type { Reason, Run } from "../../api/types";

const EXPECTED: ReadonlySet<Reason["code"]> = new Set(["run.upload_verified", "run.upload_read_back"]);

/**
 * The reason of a run's state, unless it only says that the upload succeeded (Start is the next thing to do then), or
 * that it waits for a consent that was given: the drop says so.
 */
export function notableReason({ reason, drops }: Run): Reason | null {
  if (reason === null || EXPECTED.has(reason.code)) return null;
  const waits = reason.code !== "run.waits_for_consent" || drops.some(({ consent }) => consent?.state === "asked");
  return waits ? reason : null;
}
