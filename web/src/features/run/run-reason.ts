import type { Reason, Run } from "../../api/types";

const EXPECTED: ReadonlySet<Reason["code"]> = new Set(["run.upload_verified", "run.upload_read_back"]);

/** The reason of a run's state, unless it only says that the upload succeeded: Start is the next thing to do then. */
export function notableReason(run: Run): Reason | null {
  return run.reason !== null && EXPECTED.has(run.reason.code) ? null : run.reason;
}
