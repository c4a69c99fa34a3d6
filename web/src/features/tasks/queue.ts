/** The task queue of the vehicle that is looked at: from the own socket while this page has the lease, else as read. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { TaskQueue } from "../../api/types";
import { feed, live } from "../../store/store";
import { controlledVehicle, manualControl } from "../offboard/control-state";

const read = signal<{ readonly vehicle: string; readonly queue: TaskQueue } | null>(null);

/** This page may change the queue. */
export const ownsQueue = computed(() => {
  const { phase } = manualControl.value;
  return phase === "leased" || phase === "entering" || phase === "flying";
});

/** The newest report of the stream, for a queue that is another client's. */
const streamed = computed(() =>
  manualControl.value.phase === "off" ? (controlledVehicle.value?.state.offboard?.tasks ?? null) : null,
);

/**
 * Null while there is none. For another client's queue, the report comes from the stream, and the rest was read when it
 * last changed.
 */
export const taskQueue = computed<TaskQueue | null>(() => {
  if (manualControl.value.phase !== "off") return manualControl.value.tasks;
  const report = streamed.value;
  const known = read.value;
  if (report?.current_id == null || known?.vehicle !== controlledVehicle.value?.id) return null;
  return known === null ? null : { ...known.queue, report };
});

/** Changes when another client's queue has to be read again. Events cover what the report does not. */
const readKey = computed(() => {
  const report = streamed.value;
  const vehicle = controlledVehicle.value?.id;
  if (!live.value || vehicle === undefined || report?.current_id == null) return "";
  const newest =
    feed.value.find((event) => event.vehicle_id === vehicle && event.kind === "task.changed")?.position ?? 0;
  return [vehicle, report.current_id, report.state, report.task_list.join(), newest].join("\n");
});

/** No event reports the progress of the current task, or moving targets. */
const READ_AGAIN_MS = 2000;

export function watchTaskQueue(): void {
  effect(() => {
    const key = readKey.value;
    if (key === "") {
      read.value = null;
      return undefined;
    }
    void readQueue(key);
    const timer = setInterval(() => !document.hidden && void readQueue(key), READ_AGAIN_MS);
    return () => clearInterval(timer);
  });
}

/** A failure is not shown: the stream still updates the report, and the next read follows soon. */
async function readQueue(key: string): Promise<void> {
  const vehicle = key.split("\n")[0] ?? "";
  const queue = await api.tasks(vehicle).catch(() => null);
  if (queue !== null && key === readKey.peek()) read.value = { vehicle, queue };
}
