/** The moving targets of the chosen run, asked for once a second while it is open: reports are no events. */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../api/client";
import type { Run, Target } from "../api/types";
import type { Point } from "../map/geometry";
import { viewPlan } from "../plan/document";
import { followersOf, lastWord, placeAfter, type Follower, type Word } from "../targets/following";
import { secondsSince } from "./clock";
import { runPlan } from "./run-plan";
import { isOver } from "./runs";
import { selectedRun } from "./selection";
import { feed, live } from "./store";

const EVERY_MS = 1000;
/** As the service's: an older report is neither followed nor dropped at. */
const STALE_S = 5;

/** What was told of the feeds, and when (the page's clock). */
const told = signal<{ readonly targets: Readonly<Record<string, Target>>; readonly at: number } | null>(null);

export interface ShownTarget {
  readonly follower: Follower;
  /** Null: nothing was reported yet. */
  readonly target: Target | null;
  readonly age_s: number;
  readonly stale: boolean;
  /** Where it is by now; null if nothing was reported. */
  readonly place: Point | null;
  readonly word: Word | null;
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
export const shownTargets = computed<readonly ShownTarget[] | null>(() => {
  const known = told.value;
  const open = wanted.value;
  if (open === null || open.followers.length === 0 || known === null) return null;
  return open.followers.map((follower) => {
    const target = known.targets[follower.feed] ?? null;
    const age_s = target === null ? 0 : target.age_s + secondsSince(known.at);
    const word = lastWord(feed.value, open.run.id, follower.dropId);
    return { follower, target, age_s, stale: age_s > STALE_S, place: target === null ? null : placeAfter(target, age_s), word };
  });
});

export function watchTargets(): void {
  effect(() => {
    if (feeds.value === "" || !live.value) {
      told.value = null;
      return undefined;
    }
    void read();
    const timer = setInterval(() => {
      if (!document.hidden) void read();
    }, EVERY_MS);
    return () => clearInterval(timer);
  });
}

let asked = 0;

/** The newest answer wins. One that fails changes nothing: what is shown says how old it is. */
async function read(): Promise<void> {
  const mine = ++asked;
  const targets = await api.targets().catch(() => null);
  if (targets !== null && mine === asked) told.value = { targets: Object.fromEntries(targets.map((target) => [target.feed, target])), at: performance.now() };
}
