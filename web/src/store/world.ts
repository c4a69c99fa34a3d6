/**
 * What the page knows of the world, and how each frame of the stream changes it. Pure: no clock, no socket, no DOM.
 *
 * The promise is "no gap and no double": `seq` is the last event taken in, an older one is ignored, and one that
 * leaves a hole sets `resync`, upon which the connection is opened again with `after=seq`.
 */

import type {
  EventFrame,
  EventKind,
  EventOf,
  HelloFrame,
  Job,
  JobQueue,
  Run,
  SnapshotFrame,
  StreamEvent,
  StreamFrame,
  TelemetryFrame,
  Vehicle,
} from "../api/types";
import { hasRunEnded } from "./runs";

/** Events kept for the feed. */
export const FEED_LIMIT = 500;
/** Runs, and jobs, that have ended: a page stays open for weeks. */
export const MOST_ENDED = 500;
/** Events asked for when the page is new and knows none. */
export const REPLAYED_EVENTS = 200;

export interface World {
  readonly gateway: string | null;
  /** Last event taken in; null before the first hello. The next connection asks for what comes after it. */
  readonly seq: number | null;
  /** Events up to here are already in the snapshot's state: they are for the feed only. */
  readonly snapshotSeq: number;
  readonly vehicles: Readonly<Record<string, Vehicle>>;
  readonly runs: Readonly<Record<string, Run>>;
  /** Those that were read or came by events; the stream's snapshot has none. */
  readonly jobs: Readonly<Record<string, Job>>;
  /** By vehicle. */
  readonly jobQueues: Readonly<Record<string, JobQueue>>;
  /** Newest first. */
  readonly feed: readonly StreamEvent[];
  /** The page's own clock (ms) when the vehicles' states were last measured; null before. */
  readonly measuredAt: number | null;
  /** False after the service failed to store events, until it can: runs, drops and jobs may be as they were before. */
  readonly recording: boolean;
  /** The service's Unix time less the page's own clock, both in seconds; null before the first hello. */
  readonly serviceAhead_s: number | null;
  /** The stream must be opened again at once, after `seq`. */
  readonly resync: boolean;
  /** Where a hole was found and asked for again; if it is still there, the service has it no more. */
  readonly holeAfter: number | null;
  /** The stream named a vehicle that is not in the list: the list must be read again. */
  readonly listStale: boolean;
  /** The last event that told of such a vehicle: a list that was asked for before it may be without it. */
  readonly unlisted: StreamEvent | null;
}

export const EMPTY_WORLD: World = {
  gateway: null,
  seq: null,
  snapshotSeq: 0,
  vehicles: {},
  runs: {},
  jobs: {},
  jobQueues: {},
  feed: [],
  measuredAt: null,
  recording: true,
  serviceAhead_s: null,
  resync: false,
  holeAfter: null,
  listStale: false,
  unlisted: null,
};

export type Action =
  | { readonly type: "frame"; readonly frame: StreamFrame; readonly at: number }
  | { readonly type: "opened" }
  | { readonly type: "after_refused" }
  | {
      readonly type: "vehicles_read";
      readonly vehicles: readonly Vehicle[];
      /** What was known when it was asked for. */
      readonly asked?: Pick<World, "vehicles" | "unlisted">;
    }
  | { readonly type: "run_read"; readonly run: Run }
  | {
      readonly type: "jobs_read";
      readonly jobs: readonly Job[];
      readonly queues: readonly JobQueue[];
      readonly gone?: readonly Job[];
      /** What was known when it was asked for. */
      readonly asked?: Pick<World, "jobs" | "jobQueues">;
    };
type ActionOf<T extends Action["type"]> = Extract<Action, { readonly type: T }>;

export function reduce(world: World, action: Action): World {
  switch (action.type) {
    case "opened":
      return { ...world, resync: false };
    case "after_refused":
      return { ...world, gateway: null, seq: null, holeAfter: null, feed: [], ...ofOtherService(world) };
    case "vehicles_read":
      return onVehiclesRead(world, action);
    case "run_read":
      return onRunRead(world, action.run);
    case "jobs_read":
      return onJobsRead(world, action);
    case "frame":
      return reduceFrame(world, action.frame, action.at);
  }
}

function reduceFrame(world: World, frame: StreamFrame, at: number): World {
  if (world.resync) return world; // frames of a connection that is being given up
  switch (frame.type) {
    case "hello":
      return onHello({ ...world, serviceAhead_s: frame.server_time - at / 1000 }, frame);
    case "snapshot":
      return onSnapshot(world, frame, at);
    case "event":
      return onEvent(world, frame);
    case "telemetry":
      return onTelemetry(world, frame, at);
  }
}

/** A page that knows nothing of this gateway's journal comes again for the newest part of it. */
function onHello(world: World, hello: HelloFrame): World {
  if (world.seq !== null && world.gateway === hello.gateway) return world;
  const seq = Math.max(hello.first_seq - 1, hello.seq - REPLAYED_EVENTS);
  const kept = world.gateway === null || world.gateway === hello.gateway ? {} : ofOtherService(world);
  return { ...world, ...kept, gateway: hello.gateway, seq, holeAfter: null, feed: [], resync: hello.seq > seq };
}

function onSnapshot(world: World, snapshot: SnapshotFrame, at: number): World {
  return {
    ...world,
    snapshotSeq: snapshot.seq,
    vehicles: indexById(snapshot.vehicles),
    runs: { ...runsThat(true, world.runs), ...indexById(snapshot.runs) },
    measuredAt: at,
    listStale: false,
  };
}

/** A snapshot has all runs that are open, and of the others only the newest: the older ones are kept. */
function runsThat(ended: boolean, runs: World["runs"]): World["runs"] {
  return Object.fromEntries(Object.entries(runs).filter(([, run]) => hasRunEnded(run) === ended));
}

/** Another service has other jobs and other runs. Those that are open are shown until its snapshot comes. */
function ofOtherService({ runs }: World): Pick<World, "runs" | "jobs" | "jobQueues"> {
  return { runs: runsThat(false, runs), jobs: {}, jobQueues: {} };
}

function onEvent(world: World, { event }: EventFrame): World {
  if (world.seq === null || event.position <= world.seq) return world;
  const hole = event.position > world.seq + 1;
  if (hole && world.holeAfter !== world.seq) return { ...world, resync: true, holeAfter: world.seq };
  const feed = hole ? withNewest(world.feed, missing(world.seq, event)) : world.feed;
  const seen = { ...world, seq: event.position, feed: withNewest(feed, event), holeAfter: null };
  return event.position <= world.snapshotSeq ? seen : applyEvent(seen, event);
}

/** Stands in the feed for events that the service could not give again: a hole is said, never hidden. */
function missing(after: number, next: StreamEvent): StreamEvent {
  const data = { first: after + 1, last: next.position - 1 };
  return {
    seq: next.position - 0.5,
    position: next.position - 0.5,
    time: next.time,
    kind: "page.missing",
    version: 1,
    gateway: next.gateway,
    vehicle_id: null,
    run_id: null,
    data,
    hash: "",
  };
}

function onTelemetry(world: World, frame: TelemetryFrame, at: number): World {
  const vehicles = { ...world.vehicles };
  let listStale = world.listStale;
  for (const [id, state] of Object.entries(frame.vehicles)) {
    const known = vehicles[id];
    if (known) vehicles[id] = { ...known, state };
    else listStale = true;
  }
  const { recording, time } = frame;
  return { ...world, vehicles, measuredAt: at, recording, serviceAhead_s: time - at / 1000, listStale };
}

/**
 * An answer may be older than what the stream has told since it was asked for, as of a quarantine. If that was told of
 * a vehicle that was not in the list, the list is read again.
 */
function onVehiclesRead(world: World, { vehicles, asked = world }: ActionOf<"vehicles_read">): World {
  if (asked.unlisted !== world.unlisted) return world;
  const read = vehicles.map((vehicle) => {
    const { [vehicle.id]: before } = asked.vehicles;
    return { ...vehicle, ...changes(before, world.vehicles[vehicle.id]) };
  });
  return { ...world, vehicles: indexById(read), listStale: false };
}

/** The fields that are not what they were. */
function changes<T extends object>(before: T | undefined, now: T | undefined): Partial<T> {
  const changed = Object.entries(now ?? {}).filter(([name, value]) => value !== before?.[name as keyof T]);
  return Object.fromEntries(changed) as Partial<T>;
}

/** An answer to a request may be older than what the stream has sent, which sends again what this leaves out. */
function onRunRead(world: World, run: Run): World {
  const known = world.runs[run.id];
  return known && known.updated_at >= run.updated_at ? world : withRun(world, run);
}

function withRun(world: World, run: Run): World {
  return { ...world, runs: withNew(world.runs, run, hasRunEnded) };
}

/** By its time an answer is older only than what came after it was asked for: the service's clock may be set back. */
function onJobsRead(world: World, { jobs, queues, gone = [], asked }: ActionOf<"jobs_read">): World {
  const read = withoutJobs(world.jobs, gone);
  for (const job of jobs) {
    const known = read[job.id];
    const isLate = known !== undefined && known !== asked?.jobs[job.id] && job.updated_at < known.updated_at;
    if (known === undefined || !isOlder(job, known, isLate)) read[job.id] = job;
  }
  const readQueue = (next: World, queue: JobQueue) => {
    const known = next.jobQueues[queue.vehicle_id];
    const isLate = known !== asked?.jobQueues[queue.vehicle_id] && (known?.at ?? 0) > (queue.at ?? 0);
    return isLate ? next : withJobQueue(next, queue);
  };
  return queues.reduce(readQueue, { ...world, jobs: withoutOldest(read, isJobOver) });
}

/** What comes may be older than what is known: never go back behind it. */
function withJob(world: World, job: Job): World {
  const known = world.jobs[job.id];
  if (known && isOlder(job, known, false)) return world;
  return { ...world, jobs: withNew(world.jobs, job, isJobOver) };
}

function isJobOver({ ended_at }: Job): boolean {
  return ended_at !== null;
}

/**
 * By the fencing number first: a gateway and the cluster that gave it the job have different clocks. `isLate`: of two
 * words of the same claimant.
 */
function isOlder(job: Job, known: Job, isLate: boolean): boolean {
  if (job.fence !== known.fence) return job.fence < known.fence;
  if (job.claim?.gateway !== known.claim?.gateway) return true; // only its claimant says more
  const [taken, wasTaken] = [job.claim?.taken ?? false, known.claim?.taken ?? false];
  return taken === wasTaken ? isLate : wasTaken;
}

/** Each, unless the stream updated it meanwhile. */
function withoutJobs(jobs: World["jobs"], gone: readonly Job[]): Record<string, Job> {
  const ended = new Set(gone);
  return Object.fromEntries(Object.entries(jobs).filter(([, job]) => !ended.has(job)));
}

function withJobQueue(world: World, queue: JobQueue): World {
  return { ...world, jobQueues: { ...world.jobQueues, [queue.vehicle_id]: queue } };
}

function withNew<T extends { readonly id: string }>(
  known: Readonly<Record<string, T>>,
  one: T,
  hasEnded: (one: T) => boolean,
): Readonly<Record<string, T>> {
  const all = { ...known, [one.id]: one };
  return one.id in known ? all : withoutOldest(all, hasEnded);
}

/** Of what has ended, the last that came are kept. */
function withoutOldest<T extends { readonly id: string }>(
  all: Readonly<Record<string, T>>,
  hasEnded: (one: T) => boolean,
): Readonly<Record<string, T>> {
  const ended = Object.values(all).filter(hasEnded);
  if (ended.length <= MOST_ENDED) return all;
  const leftOut = new Set(ended.slice(0, -MOST_ENDED).map(({ id }) => id));
  return Object.fromEntries(Object.entries(all).filter(([id]) => !leftOut.has(id)));
}

function withNewest(feed: readonly StreamEvent[], event: StreamEvent): readonly StreamEvent[] {
  return [event, ...feed.slice(0, FEED_LIMIT - 1)];
}

function indexById<T extends { id: string }>(list: readonly T[]): Record<string, T> {
  return Object.fromEntries(list.map((item) => [item.id, item]));
}

// How one event changes vehicles and runs. Unknown kinds change nothing: they are for the feed. Pure.

type Apply<K extends EventKind> = (world: World, event: EventOf<K>) => World;

const APPLY: { readonly [K in EventKind]?: Apply<K> } = {
  "vehicle.seen": onSeen,
  "vehicle.link_lost": (world, event) => withState(world, event, { connected: false }),
  "vehicle.link_restored": (world, event) => withState(world, event, { connected: true }),
  "vehicle.changed": (world, event) => withState(world, event, event.data),
  "vehicle.link_security": (world, event) => withState(world, event, { link_security: event.data.security }),
  "vehicle.quarantined": (world, event) => withListed(world, event, () => ({ quarantined: event.data.reason })),
  "vehicle.quarantine_ended": (world, event) => withListed(world, event, () => ({ quarantined: null })),
  "run.created": onRun,
  "run.changed": onRun,
  "run.continued": onRun,
  "run.taken_over": onRun,
  "run.upload_progress": onUploadProgress,
  "run.item": onItem,
  "run.drop": onDrop,
  "job.changed": (world, event) => withJob(world, event.data.job),
  "job.queue_changed": (world, event) => withJobQueue(world, event.data.queue),
};

export function applyEvent(world: World, event: StreamEvent): World {
  return (APPLY[event.kind] as Apply<EventKind> | undefined)?.(world, event as never) ?? world;
}

function onSeen(world: World, event: EventOf<"vehicle.seen">): World {
  const { vehicle_type, firmware, uid } = event.data;
  return withListed(world, event, (known) => ({
    vehicle_type: vehicle_type ?? known.vehicle_type,
    firmware: firmware ?? known.firmware,
    uid: uid ?? known.uid,
  }));
}

type RunEventKind = "run.created" | "run.changed" | "run.continued" | "run.taken_over";

/** Events go by their place in the journal and by no time: the service's clock may be set back. */
function onRun(world: World, { data: run }: EventOf<RunEventKind>): World {
  const known = world.runs[run.id];
  if (known && handovers(known) > handovers(run)) return world; // of the gateway that lost it to another one
  return withRun(world, run);
}

function handovers(run: Run): number {
  return run.taken_over?.number ?? 0;
}

function onUploadProgress(world: World, event: EventOf<"run.upload_progress">): World {
  return changeRun(world, event, () => ({ upload_percent: event.data.percent }));
}

function onItem(world: World, event: EventOf<"run.item">): World {
  const { item_id: id, phase } = event.data;
  if (id === null) return world;
  if (phase !== "reached") return changeRun(world, event, () => ({ item_id: id }));
  return changeRun(world, event, (run) => {
    const flown = run.flown_item_ids ?? [];
    return flown.at(-1) === id ? {} : { flown_item_ids: [...flown, id] };
  });
}

function onDrop(world: World, event: EventOf<"run.drop">): World {
  const drop = event.data;
  return changeRun(world, event, (run) => ({
    drops: run.drops.map((known) => (known.plan_item_id === drop.plan_item_id ? { ...known, ...drop } : known)),
  }));
}

function changeRun(world: World, event: StreamEvent, change: (run: Run) => Partial<Run>): World {
  const run = event.run_id === null ? undefined : world.runs[event.run_id];
  if (!run) return world;
  return withRun(world, { ...run, ...change(run) });
}

/** What telemetry does not tell. Events carry no vehicle's state: a new one is read from the list, with all of this. */
function withListed(world: World, event: StreamEvent, change: (known: Vehicle) => Partial<Vehicle>): World {
  const isListed = event.vehicle_id !== null && event.vehicle_id in world.vehicles;
  return isListed ? withVehicle(world, event, change) : { ...world, listStale: true, unlisted: event };
}

function withVehicle(world: World, event: StreamEvent, change: (known: Vehicle) => Partial<Vehicle>): World {
  const known = event.vehicle_id === null ? undefined : world.vehicles[event.vehicle_id];
  if (!known) return world;
  return { ...world, vehicles: { ...world.vehicles, [known.id]: { ...known, ...change(known) } } };
}

function withState(world: World, event: StreamEvent, change: object): World {
  return withVehicle(world, event, (known) => ({ state: { ...known.state, ...change } }));
}
