/** How one event changes vehicles and runs. Unknown kinds change nothing: they are for the feed. Pure. */

import type { DropRecord, EventKind, Job, JobQueue, Run, Vehicle } from "../api/types";
import type { StreamEvent } from "../api/types";
import { withJob, withJobQueue, withRun, type World } from "./world";

type Apply = (world: World, event: StreamEvent) => World;

const APPLY: Readonly<Partial<Record<EventKind, Apply>>> = {
  "vehicle.seen": onSeen,
  "vehicle.link_lost": (world, event) => withState(world, event, { connected: false }),
  "vehicle.link_restored": (world, event) => withState(world, event, { connected: true }),
  "vehicle.changed": (world, event) => withState(world, event, event.data),
  "vehicle.quarantined": (world, event) => withVehicle(world, event, () => ({ quarantined: words(event.data["reason"]) })),
  "run.created": onRun,
  "run.changed": onRun,
  "run.continued": onRun,
  "run.upload_progress": onUploadProgress,
  "run.item": onItem,
  "run.drop": onDrop,
  "job.changed": (world, event) => withJob(world, event.data["job"] as Job),
  "job.queue_changed": (world, event) => withJobQueue(world, event.data["queue"] as JobQueue),
};

export function applyEvent(world: World, event: StreamEvent): World {
  return APPLY[event.kind]?.(world, event) ?? world;
}

/** `vehicle.seen` carries who it is and not its state: a new one is read from the list. */
function onSeen(world: World, event: StreamEvent): World {
  if (event.vehicle_id === null || !(event.vehicle_id in world.vehicles)) return { ...world, listStale: true };
  const { vehicle_type, firmware, uid } = event.data as Partial<Vehicle>;
  return withVehicle(world, event, (known) => ({
    vehicle_type: vehicle_type ?? known.vehicle_type,
    firmware: firmware ?? known.firmware,
    uid: uid ?? known.uid,
  }));
}

function onRun(world: World, event: StreamEvent): World {
  const run = event.data as unknown as Run;
  const known = world.runs[run.id]; // a snapshot may hold more than its seq says: never go back behind it
  return known && known.updated_at > run.updated_at ? world : withRun(world, run);
}

function onUploadProgress(world: World, event: StreamEvent): World {
  const percent = event.data["percent"];
  return typeof percent === "number" ? changeRun(world, event, () => ({ upload_percent: percent })) : world;
}

function onItem(world: World, event: StreamEvent): World {
  const { item_id: id, what } = event.data;
  if (typeof id !== "string") return world;
  if (what !== "reached") return changeRun(world, event, () => ({ item_id: id }));
  return changeRun(world, event, (run) => {
    const flown = run.flown_item_ids ?? [];
    return flown.at(-1) === id ? {} : { flown_item_ids: [...flown, id] };
  });
}

function onDrop(world: World, event: StreamEvent): World {
  const drop = event.data as unknown as DropRecord;
  return changeRun(world, event, (run) => ({
    drops: run.drops.map((known) => (known.plan_item_id === drop.plan_item_id ? { ...known, ...drop } : known)),
  }));
}

function changeRun(world: World, event: StreamEvent, change: (run: Run) => Partial<Run>): World {
  const run = event.run_id === null ? undefined : world.runs[event.run_id];
  if (!run) return world;
  return withRun(world, { ...run, ...change(run) });
}

function withVehicle(world: World, event: StreamEvent, change: (known: Vehicle) => Partial<Vehicle>): World {
  const known = event.vehicle_id === null ? undefined : world.vehicles[event.vehicle_id];
  if (!known) return world;
  return { ...world, vehicles: { ...world.vehicles, [known.id]: { ...known, ...change(known) } } };
}

function withState(world: World, event: StreamEvent, change: object): World {
  return withVehicle(world, event, (known) => ({ state: { ...known.state, ...change } }));
}

function words(value: unknown): string {
  return typeof value === "string" && value !== "" ? value : "for a reason that was not given";
}
