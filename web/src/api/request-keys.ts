/** Idempotency-Keys. A request that is sent again because its answer was lost keeps its key, and acts once. */

/** Whoever sends the same later than that means another one. */
const KEPT_MS = 600_000;

/** By request: its key, and when it was sent last (ms). */
const unanswered = new Map<string, { readonly key: string; readonly at: number }>();

/** The key of a request; that of the same request before, if that got no answer. */
export function requestKey(request: string): string {
  const at = performance.now();
  for (const [other, sent] of unanswered) if (at - sent.at > KEPT_MS) unanswered.delete(other);
  const key = unanswered.get(request)?.key ?? randomKey();
  unanswered.set(request, { key, at });
  return key;
}

/** It is known what came of the request: the same one again is another one. */
export function forgetKey(request: string): void {
  unanswered.delete(request);
}

/** 128 random bits. crypto.randomUUID would need https where the service is not on this machine. */
function randomKey(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}
