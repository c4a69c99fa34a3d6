import { computed } from "@preact/signals";
import type { Run } from "../../api/types";
import { formatDistance } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { secondsSince, serviceNow } from "../../store/clock";
import { hasRunEnded } from "../../store/runs";
import { selectedRun } from "../../store/selection";
import { feed, vehicles, world } from "../../store/store";
import { Badge } from "../../ui/badge";
import { sightingIn, targetReports } from "../targets/reports";
import {
  describeFollowing,
  describeMotion,
  followersOf,
  lastUpdate,
  type ShownTarget,
  type TargetFollower,
} from "../targets/targets";
import { runPlanView } from "./run-plan";

/** What the drops of this run follow. */
export function MovingTargets({ vehicle }: { vehicle: string }) {
  const shown = runTargets.value;
  if (shown === null) return null;
  return (
    <section aria-label="Moving targets" class="targets">
      {shown.map((one) => (
        <TargetCard key={one.follower.dropId} shown={one} vehicle={vehicle} />
      ))}
    </section>
  );
}

function TargetCard({ shown, vehicle }: { shown: RunTarget; vehicle: string }) {
  const at = vehiclePoint(vehicles.value[vehicle] ?? null);
  const [tone, label] =
    shown.target === null
      ? (["warn", "No report"] as const)
      : shown.stale
        ? (["warn", "Stale"] as const)
        : (["ok", "Tracked"] as const);
  return (
    <article class="target-card" data-feed={shown.feed}>
      <header>
        <b>Target {shown.feed}</b>
        <small>of {shown.follower.dropId}</small>
        <Badge tone={tone}>{label}</Badge>
      </header>
      <p>{describeMotion(shown)}</p>
      {shown.place !== null && at !== null && (
        <p>
          {formatDistance(metresBetween(at, shown.place))} from {vehicle} now.
        </p>
      )}
      <p>{describeFollowing(shown, serviceNow(world.value.serviceAhead_s))}</p>
    </article>
  );
}

// The moving targets that the page shows: of the chosen run while it is open, and those that a task may follow.

interface RunTarget extends ShownTarget {
  readonly follower: TargetFollower;
}

/** Of the chosen run: drops that follow a target and are not over. */
const wanted = computed<{ readonly run: Run; readonly followers: readonly TargetFollower[] } | null>(() => {
  const run = selectedRun.value;
  if (run === null || hasRunEnded(run)) return null;
  const plan = runPlanView.value;
  const open = new Set(run.drops.filter(({ phase }) => phase !== "done").map((drop) => drop.plan_item_id));
  const followers = plan === null ? [] : followersOf(plan).filter(({ dropId }) => open.has(dropId));
  return { run, followers };
});
/** Whether a drop of the chosen run follows a target that is still to be met. */
export const runFollowsTarget = computed(() => (wanted.value?.followers.length ?? 0) > 0);

/** Follows the clock, where there is anything to follow. */
export const runTargets = computed<readonly RunTarget[] | null>(() => {
  const read = targetReports.value;
  const open = wanted.value;
  if (open === null || open.followers.length === 0 || read === null) return null;
  const after_s = secondsSince(read.at);
  return open.followers.map((follower) => ({
    ...sightingIn(read, follower.feed, after_s),
    follower,
    feed: follower.feed,
    word: lastUpdate(feed.value, open.run.id, follower.dropId),
  }));
});
