/** Names that a lease could be handed over to: those who had one, or commanded something, as far as the feed goes back. */

import { computed } from "@preact/signals";
import type { StreamEvent } from "../api/types";
import { principal } from "./principal";
import { feed } from "./store";

/** As text: the feed changes all the time, and who is in it seldom. */
const names = computed(() => JSON.stringify(namesIn(feed.value, principal.value?.name ?? null)));
export const knownNames = computed<readonly string[]>(() => JSON.parse(names.value) as string[]);

/** Who an event tells of, whatever its kind. */
function namesOf({ data }: StreamEvent): unknown[] {
  return ["holder", "by", "requested_by"].map((field) => Reflect.get(data, field));
}

function namesIn(events: readonly StreamEvent[], own: string | null): string[] {
  const found = new Set([...events.flatMap(namesOf), own].filter((name): name is string => typeof name === "string" && name !== ""));
  return [...found].sort();
}
