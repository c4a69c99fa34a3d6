/** Errors of the service (RFC 9457 problem+json) and of the way to it, as one thing that can be shown in words. */

import type { Finding } from "./types";

export class ProblemError extends Error {
  override readonly name = "ProblemError";

  constructor(
    readonly status: number,
    readonly code: string,
    readonly title: string,
    readonly detail: string,
    readonly hint: string,
    readonly findings: readonly Finding[],
  ) {
    super(detail || title);
  }
}

/** The service always gives a hint: this is the answer of something between it and the page. */
const FALLBACK_HINT = "Check the proxy between this page and Waydrop, then try again.";

/** A problem from the body of an answer; a body that is no problem document still becomes words. */
export function parseProblem(status: number, body: unknown): ProblemError {
  const doc = isRecord(body) ? body : {};
  const title = text(doc["title"]) || `The service answered ${status}`;
  const findings = Array.isArray(doc["findings"]) ? doc["findings"].filter(isRecord).map(findingFrom) : [];
  return new ProblemError(
    status,
    text(doc["code"]) || `http.${status}`,
    title,
    text(doc["detail"]),
    text(doc["hint"]) || FALLBACK_HINT,
    findings,
  );
}

/** No answer at all: the service is down or the network is. */
export function unreachableProblem(): ProblemError {
  const hint = "The page reconnects by itself. Try again when it is live.";
  return new ProblemError(0, "unreachable", "The service does not answer", "Nothing was sent.", hint, []);
}

/** Whatever was thrown, as a problem: the caller shows it and never loses it. */
export function toProblem(error: unknown): ProblemError {
  if (error instanceof ProblemError) return error;
  const detail = error instanceof Error ? error.message : String(error);
  return new ProblemError(0, "page", "The page failed", detail, "Reload the page.", []);
}

function findingFrom(doc: Record<string, unknown>): Finding {
  return {
    code: text(doc["code"]),
    severity: doc["severity"] === "warning" ? "warning" : "error",
    pointer: text(doc["pointer"]),
    message: text(doc["message"]),
    hint: text(doc["hint"]),
    item_id: text(doc["item_id"]) || null,
    assumed: Array.isArray(doc["assumed"]) ? doc["assumed"].map(text) : [],
  };
}

function text(value: unknown): string {
  return typeof value === "string" ? value : "";
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
