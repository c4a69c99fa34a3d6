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

/** What is open about a request without an answer, and what to do then. */
interface Unanswered {
  readonly detail: string;
  readonly hint: string;
}

/** They are posted for their bodies, and change nothing. */
const CHECKS: ReadonlySet<string> = new Set(["plan-checks", "plan-conversions", "job-checks"]);

/** Where it is seen whether a request was carried out, by the first name in its path. */
const LOOK_AT: Readonly<Record<string, string>> = {
  plans: "the plan library",
  runs: "the run",
  jobs: "the jobs",
  "job-queues": "the jobs",
  vehicles: "the vehicle",
  simulator: "the simulator",
};

/** `path`: as the API has it, /api/v1/runs. */
export function unansweredRequest(method: string, path: string): Unanswered {
  const noun = path.split("/")[3] ?? "";
  const again = "The page reconnects by itself. Try again when it is live.";
  if (method === "GET") return { detail: "This could not be loaded.", hint: again };
  if (CHECKS.has(noun)) return { detail: "Nothing was changed.", hint: again };
  const hint = `When the page is live again, look at ${LOOK_AT[noun] ?? "the events"} before you try again.`;
  return { detail: "It is unknown whether this was carried out.", hint };
}

/** The service always gives a hint: an answer without one is of something between it and the page. */
const FALLBACK_HINT = "Check the proxy between this page and Waydrop";

/** A problem from the body of an answer; a body that is no problem document still becomes words. */
export function parseProblem(status: number, body: unknown, unanswered: Unanswered | null = null): ProblemError {
  const doc = isRecord(body) ? body : {};
  const title = text(doc["title"]) || `The service answered ${status}`;
  const open = status >= 500 && text(doc["code"]) === "" ? unanswered : null; // a proxy does not know what came of it
  const findings = Array.isArray(doc["findings"]) ? doc["findings"].filter(isRecord).map(findingFrom) : [];
  return new ProblemError(
    status,
    text(doc["code"]) || `http.${status}`,
    title,
    text(doc["detail"]) || (open?.detail ?? ""),
    text(doc["hint"]) || (open === null ? `${FALLBACK_HINT}, then try again.` : `${FALLBACK_HINT}. ${open.hint}`),
    findings,
  );
}

/** No answer at all: the service is down or the network is. What was sent may have arrived all the same. */
export function unreachableProblem({ detail, hint }: Unanswered): ProblemError {
  return new ProblemError(0, "unreachable", "The service does not answer", detail, hint, []);
}

/** The service did what was asked, or says what it has, and the page cannot read it. */
export function unreadableProblem(status: number, { detail, hint }: Unanswered): ProblemError {
  return new ProblemError(status, "answer.unreadable", "The answer cannot be read", detail, hint, []);
}

/** Whether it is known what came of a request that ended with this. */
export function tellsOutcome(error: unknown): boolean {
  if (!(error instanceof ProblemError)) return false;
  const { status, code } = error;
  return status >= 400 && status < 500 && code !== "idempotency.outcome_unknown";
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
