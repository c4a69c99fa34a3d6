/** The moving targets that the page shows: of the chosen run while it is open, and those that a task may follow. */

import { computed } from "@preact/signals";
import type { Run } from "../api/types";
import { viewPlan } from "../plan/document";
import { followersOf, lastWord, type Follower, type Seen, type Word } from "../targets/following";
import { secondsSince } from "./clock";
import { followedTasks } from "./followed-tasks";
import { runPlan } from "./run-plan";
import { isOver } from "./runs";
import { panel, selectedRun } from "./selection";
import { feed } from "./store";
import { reports, seenIn, watchTargetReports } from "./target-reports";
import { taskKind } from "./task-draft";
import { ownsQueue } from "./task-queue";

export interface ShownTarget extends Seen {
  /** The drop that follows it; null: none of the chosen run. */
  readonly follower: Follower | null;
  readonly feed: string;
  readonly word: Word | null;
}

export interface RunTarget extends ShownTarget {
  readonly follower: Follower;
}

/** Of the chosen run: drops that follow a target and are not over. */
const wanted = computed<{ readonly run: Run; readonly followers: readonly Follower[] } | null>(() => {
  const run = selectedRun.value;
  if (run === null || isOver(run)) return null;
  const stored = runPlan.value;
  const open = new Set(run.drops.filter(({ phase }) => phase !== "done").map((drop) => drop.plan_item_id));
  const followers = stored === null ? [] : followersOf(viewPlan(stored.plan)).filter(({ dropId }) => open.has(dropId));
  return { run, followers };
});
const feeds = computed(() => wanted.value?.followers.map((follower) => follower.feed).join("\n") ?? "");

/** Follows the clock, where there is anything to follow. */
export const shownTargets = computed<readonly RunTarget[] | null>(() => {
  const read = reports.value;
  const open = wanted.value;
  if (open === null || open.followers.length === 0 || read === null) return null;
  const after_s = secondsSince(read.at);
  return open.followers.map((follower) => ({ ...seenIn(read, follower.feed, after_s), follower, feed: follower.feed, word: lastWord(feed.value, open.run.id, follower.dropId) }));
});

/** All that report, while a task is put together that may follow one, or follows one already. */
const forTasks = computed(() => ownsQueue.value && (taskKind.value === "goto" || followedTasks.value.size > 0));

/** What the map shows: those of the chosen run, and those that a task may follow. */
export const mapTargets = computed<readonly ShownTarget[] | null>(() => {
  const ofRun = panel.value === "plan" ? null : shownTargets.value;
  const read = reports.value;
  if (!forTasks.value || read === null) return ofRun;
  const after_s = secondsSince(read.at);
  const others = Object.keys(read.targets).filter((name) => ofRun?.every((one) => one.feed !== name) ?? true);
  return [...(ofRun ?? []), ...others.map((name) => ({ ...seenIn(read, name, after_s), follower: null, feed: name, word: null }))];
});

export function watchTargets(): void {
  watchTargetReports(computed(() => feeds.value !== "" || forTasks.value));
}
