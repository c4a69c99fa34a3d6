/** Labels of MAVLink's enumerations. A value that lacks a label fails the type check. Pure. */

import type { MavResult, MavSeverity } from "../api/types";
import type { Tone } from "./labels";
import { humanize } from "./text";

const RESULTS: Readonly<Record<MavResult, readonly [string, Tone]>> = {
  ACCEPTED: ["accepted", "ok"],
  TEMPORARILY_REJECTED: ["temporarily rejected", "danger"],
  DENIED: ["denied", "danger"],
  UNSUPPORTED: ["unsupported", "danger"],
  FAILED: ["failed", "danger"],
  IN_PROGRESS: ["in progress", "info"],
  CANCELLED: ["cancelled", "danger"],
  COMMAND_LONG_ONLY: ["accepted as COMMAND_LONG only", "danger"],
  COMMAND_INT_ONLY: ["accepted as COMMAND_INT only", "danger"],
  COMMAND_UNSUPPORTED_MAV_FRAME: ["unsupported frame", "danger"],
};

/** `result` is null where MAVLink has no name for `code`. */
export function resultLabel(result: MavResult | null, code: number | null = null): string {
  if (result === null) return code === null ? "unknown result" : `MAV_RESULT ${code}`;
  return RESULTS[result]?.[0] ?? humanize(result);
}

export function resultTone(result: MavResult | null): Tone {
  return result === null ? "danger" : (RESULTS[result]?.[1] ?? "danger");
}

const SEVERITIES: Readonly<Record<MavSeverity, Tone>> = {
  emergency: "danger",
  alert: "danger",
  critical: "danger",
  error: "danger",
  warning: "warn",
  notice: "neutral",
  info: "neutral",
  debug: "neutral",
};

export function severityTone(severity: MavSeverity): Tone {
  return SEVERITIES[severity] ?? "neutral";
}
