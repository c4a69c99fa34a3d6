/**
 * Tasks of this page's lease that follow a reporting target: each new report is sent to the service while the page is
 * visible, because each of these requests renews the lease. Without a new report the service assumes after 5 s that
 * the target is stationary.
 */

import { effect, signal } from "@preact/signals";
import { isPageActive } from "../offboard/activity";
import { requestQueue } from "../offboard/control-session";
import { manualControl } from "../offboard/control-state";
import type { Refusal } from "../offboard/refusal";
import { sightingIn, targetReports } from "../targets/reports";
import { currentMotion } from "../targets/targets";
import { taskQueue } from "./queue";

export interface Followed {
  readonly feed: string;
  /** Why the newest report was refused. */
  readonly refusal: Refusal | null;
}

/** By the id of the task. */
export const followedTasks = signal<ReadonlyMap<string, Followed>>(new Map());

export function followWith(task_id: string, feed: string): void {
  change(task_id, { feed, refusal: null });
}

function change(task_id: string, followed: Followed): void {
  followedTasks.value = new Map([...followedTasks.peek(), [task_id, followed]]);
}

/** The time of the last report that was sent, by task. */
const sent = new Map<string, number>();

export function watchFollowedTasks(): void {
  effect(() => {
    const { phase } = manualControl.value;
    if (phase !== "off" && phase !== "opening") return;
    sent.clear();
    if (followedTasks.peek().size > 0) followedTasks.value = new Map();
  });
  effect(() => {
    const read = targetReports.value;
    if (read === null || !isPageActive()) return;
    for (const { id } of taskQueue.peek()?.tasks ?? []) {
      const followed = followedTasks.peek().get(id);
      if (followed !== undefined) void sendTarget(id, followed);
    }
  });
}

async function sendTarget(task_id: string, { feed, refusal: was }: Followed): Promise<void> {
  const read = targetReports.peek();
  if (read === null) return;
  const seen = sightingIn(read, feed, (performance.now() - read.at) / 1000);
  const now = currentMotion(seen);
  if (now === null || seen.target === null || sent.get(task_id) === seen.target.report.time) return;
  sent.set(task_id, seen.target.report.time);
  const refusal = await requestQueue(`Follow ${feed}`, { type: "target", task_id, ...now });
  if (refusal?.code === "resource.not_found") return; // it is over
  if (refusal?.code !== was?.code && followedTasks.peek().has(task_id)) change(task_id, { feed, refusal });
}
