/**
 * The one place where the pure world meets signals: frames go in through `takeFrame`, components read the signals.
 *
 * Every frame is taken into the world at once and in order, so that nothing is dropped; the signals follow with the
 * screen's next frame, so that a page that is slower than the stream draws the newest and not each.
 */

import { batch, computed, signal } from "@preact/signals";
import type { ConnectionStatus } from "../api/stream";
import type { StreamFrame } from "../api/types";
import { serviceNow } from "./clock";
import { NextFrame } from "./frame-pacing";
import { telemetryHistory, telemetryVersion } from "./telemetry-history";
import { extendTracks, type Tracks } from "./tracks";
import { type Action, EMPTY_WORLD, reduce, type World } from "./world";

export const world = signal<World>(EMPTY_WORLD);
export const status = signal<ConnectionStatus>({ kind: "connecting" });
export const tracks = signal<Tracks>({});

export const vehicles = computed(() => world.value.vehicles);
export const runs = computed(() => world.value.runs);
export const jobs = computed(() => world.value.jobs);
export const jobQueues = computed(() => world.value.jobQueues);
export const feed = computed(() => world.value.feed);
export const live = computed(() => status.value.kind === "live");

/** The service's time in whole Unix seconds; null if it is not known. */
export const serviceSeconds = computed(() => {
  const at = serviceNow(world.value.serviceAhead_s);
  return at === null ? null : Math.floor(at);
});
/** The date of that here, as toDateString() has it. */
export const today = computed(() =>
  (serviceSeconds.value === null ? new Date() : new Date(serviceSeconds.value * 1000)).toDateString(),
);

/** One text, so that telemetry, which never changes it, neither sorts nor redraws the list. */
const joinedIds = computed(() => Object.keys(vehicles.value).join("\n"));
const asPeopleCount = new Intl.Collator("en", { numeric: true });
/** Sorted as people count: v2 before v10. */
export const vehicleIds = computed(() =>
  joinedIds.value === "" ? [] : joinedIds.value.split("\n").sort(asPeopleCount.compare),
);

/** What was taken in; the signals are at most one frame of the screen behind it. */
let newest = EMPTY_WORLD;
let newestTracks: Tracks = {};
let grown = false;

const shown = new NextFrame(() =>
  batch(() => {
    world.value = newest;
    tracks.value = newestTracks;
    if (grown) telemetryVersion.value += 1;
    grown = false;
  }),
);

/** An action of the user: the signals update at once. */
export function dispatch(action: Action): void {
  newest = reduce(newest, action);
  shown.now();
}

/** Last event taken in; null before the first hello. */
export function lastSeq(): number | null {
  return newest.seq;
}

/** The journal that it was read from, as hello named it. */
export function journalName(): string | null {
  return newest.gateway;
}

/** One frame of the stream at the page's own time. True if the stream must be opened again. */
export function receiveFrame(frame: StreamFrame): boolean {
  newest = reduce(newest, { type: "frame", frame, at: performance.now() });
  if (frame.type === "telemetry") {
    newestTracks = extendTracks(newestTracks, frame.vehicles, frame.time);
    grown = telemetryHistory.add(frame.vehicles, frame.time) || grown;
  }
  if (frame.type === "telemetry" || frame.type === "event") shown.request();
  else shown.now(); // when the stream becomes live, the fleet must be there
  return newest.resync;
}
