/** How one event changes vehicles and runs. Unknown kinds change nothing: they are for the feed. Pure. */

import type { EventKind, EventOf, Run, StreamEvent, Vehicle } from "../api/types";
import { withJob, withJobQueue, withRun, type World } from "./world";

type Apply<K extends EventKind> = (world: World, event: EventOf<K>) => World;

const APPLY: { readonly [K in EventKind]?: Apply<K> } = {
  "vehicle.seen": onSeen,
  "vehicle.link_lost": (world, event) => withState(world, event, { connected: false }),
  "vehicle.link_restored": (world, event) => withState(world, event, { connected: true }),
  "vehicle.changed": (world, event) => withState(world, event, event.data),
  "vehicle.quarantined": (world, event) => withVehicle(world, event, () => ({ quarantined: event.data.reason })),
  "run.created": onRun,
  "run.changed": onRun,
  "run.continued": onRun,
  "run.upload_progress": onUploadProgress,
  "run.item": onItem,
  "run.drop": onDrop,
  "job.changed": (world, event) => withJob(world, event.data.job),
  "job.queue_changed": (world, event) => withJobQueue(world, event.data.queue),
};

export function applyEvent(world: World, event: StreamEvent): World {
  return (APPLY[event.kind] as Apply<EventKind> | undefined)?.(world, event as never) ?? world;
}

/** `vehicle.seen` carries who it is and not its state: a new one is read from the list. */
function onSeen(world: World, event: EventOf<"vehicle.seen">): World {
  if (event.vehicle_id === null || !(event.vehicle_id in world.vehicles)) return { ...world, listStale: true };
  const { vehicle_type, firmware, uid } = event.data;
  return withVehicle(world, event, (known) => ({
    vehicle_type: vehicle_type ?? known.vehicle_type,
    firmware: firmware ?? known.firmware,
    uid: uid ?? known.uid,
  }));
}

function onRun(world: World, { data: run }: EventOf<"run.created" | "run.changed" | "run.continued">): World {
  const known = world.runs[run.id]; // a snapshot may hold more than its seq says: never go back behind it
  return known && known.updated_at > run.updated_at ? world : withRun(world, run);
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

function withVehicle(world: World, event: StreamEvent, change: (known: Vehicle) => Partial<Vehicle>): World {
  const known = event.vehicle_id === null ? undefined : world.vehicles[event.vehicle_id];
  if (!known) return world;
  return { ...world, vehicles: { ...world.vehicles, [known.id]: { ...known, ...change(known) } } };
}

function withState(world: World, event: StreamEvent, change: object): World {
  return withVehicle(world, event, (known) => ({ state: { ...known.state, ...change } }));
}
