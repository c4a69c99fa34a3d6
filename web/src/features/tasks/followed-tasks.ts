/**
 * Tasks of this page's lease that follow a target that reports: of each new report the service is told where it is,
 * as long
 * as somebody looks at the page, for each word renews the lease. What is not told anew counts as standing after 5 s.
 */

import { effect, signal } from "@preact/signals";
import { isPresent } from "../offboard/attendance";
import { askQueue } from "../offboard/control-session";
import { manualControl } from "../offboard/control-state";
import type { Refusal } from "../offboard/refusal";
import { reports, seenIn } from "../targets/reports";
import { targetNow } from "../targets/targets";
import { taskQueue } from "./queue";

export interface Followed {
  readonly feed: string;
  /** Why the newest word of it was not taken. */
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

/** The report that was told last, by task. */
const told = new Map<string, number>();

export function watchFollowedTasks(): void {
  effect(() => {
    const { phase } = manualControl.value;
    if (phase !== "off" && phase !== "opening") return;
    told.clear();
    if (followedTasks.peek().size > 0) followedTasks.value = new Map();
  });
  effect(() => {
    const read = reports.value;
    if (read === null || !isPresent()) return;
    for (const { id } of taskQueue.peek()?.tasks ?? []) {
      const followed = followedTasks.peek().get(id);
      if (followed !== undefined) void tell(id, followed);
    }
  });
}

async function tell(task_id: string, { feed, refusal: was }: Followed): Promise<void> {
  const read = reports.peek();
  if (read === null) return;
  const seen = seenIn(read, feed, (performance.now() - read.at) / 1000);
  const now = targetNow(seen);
  if (now === null || seen.target === null || told.get(task_id) === seen.target.report.time) return;
  told.set(task_id, seen.target.report.time);
  const refusal = await askQueue(`Follow ${feed}`, { type: "target", task_id, ...now });
  if (refusal?.code === "resource.not_found") return; // it is over
  if (refusal?.code !== was?.code && followedTasks.peek().has(task_id)) change(task_id, { feed, refusal });
}
