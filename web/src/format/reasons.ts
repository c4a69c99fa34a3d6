/**
 * A reason of the service in words: its code's sentence, as the service's own tables have it, with what it is about.
 * Pure.
 */

import type { Reason, ReasonCode } from "../api/types";
import words from "./reasons.json";

const WORDS: Readonly<Record<ReasonCode, string>> = words;

/** A sentence without its capital and its full stop; "" for none. A code of a newer service is shown as it is. */
export function formatReason(reason: Reason | null | undefined): string {
  if (reason === null || reason === undefined) return "";
  const text = WORDS[reason.code] ?? reason.code;
  return text.replace(/\{(\w+)(?::([^}]*))?\}/g, (_, name: string, form: string | undefined) =>
    name === "cause" ? formatReason(reason.cause) : shown(reason.params?.[name], form ?? ""),
  );
}

/** As Python formats it: ".1f" decimals, ".3g" significant digits, "g" six of them. */
function shown(value: string | number | null | undefined, form: string): string {
  if (value === null || value === undefined) return "?";
  if (typeof value === "string") return value;
  const [, digits = "6", kind] = /^(?:\.(\d+))?([fg])$/.exec(form) ?? [];
  if (kind === "f") return value.toFixed(Number(digits));
  return kind === "g" ? String(Number(value.toPrecision(Number(digits)))) : String(value);
}

/** Whether two reasons say the same of the same. */
export function isSameReason(one: Reason | null, other: Reason | null): boolean {
  return JSON.stringify(one) === JSON.stringify(other);
}
