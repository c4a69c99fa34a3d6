/** The one place where the pure world meets signals: frames go in through `dispatch`, components read the signals. */

import { computed, signal } from "@preact/signals";
import type { Frame } from "../stream/frames";
import type { Status } from "../stream/connection";
import { extendStrips } from "./strips";
import { extendTracks, type Tracks } from "./tracks";
import { EMPTY_WORLD, reduce, type Action, type World } from "./world";

export const world = signal<World>(EMPTY_WORLD);
export const status = signal<Status>({ kind: "connecting" });
export const tracks = signal<Tracks>({});

export const vehicles = computed(() => world.value.vehicles);
export const runs = computed(() => world.value.runs);
export const jobs = computed(() => world.value.jobs);
export const jobQueues = computed(() => world.value.jobQueues);
export const feed = computed(() => world.value.feed);
export const live = computed(() => status.value.kind === "live");
/** One text, so that telemetry, which never changes it, does not redraw the list. */
const joinedIds = computed(() => Object.keys(vehicles.value).sort(new Intl.Collator("en", { numeric: true }).compare).join("\n"));
/** Sorted as people count: v2 before v10. */
export const vehicleIds = computed(() => (joinedIds.value === "" ? [] : joinedIds.value.split("\n")));

export function dispatch(action: Action): World {
  world.value = reduce(world.value, action);
  return world.value;
}

/** One frame of the stream at the page's own time. True if the stream must be opened again. */
export function takeFrame(frame: Frame): boolean {
  const after = dispatch({ type: "frame", frame, at: performance.now() });
  if (frame.type === "telemetry") {
    tracks.value = extendTracks(tracks.value, frame.vehicles, frame.time);
    extendStrips(frame.vehicles, frame.time);
  }
  return after.resync;
}
