import { followedWords, motionWords } from "../format/target-words";
import { distance } from "../format/units";
import { vehiclePoint } from "../map/camera";
import { metresBetween } from "../map/geometry";
import { serviceNow } from "../state/clock";
import { vehicles, world } from "../state/store";
import { shownTargets, type RunTarget } from "../state/targets";
import { Badge } from "./badge";

/** What the drops of this run follow. */
export function MovingTargets({ vehicle }: { vehicle: string }) {
  const shown = shownTargets.value;
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
  const [tone, verdict] = shown.target === null ? (["warn", "Not seen"] as const) : shown.stale ? (["warn", "Stale"] as const) : (["ok", "Seen"] as const);
  return (
    <article class="target-card" data-feed={shown.feed}>
      <header>
        <b>Target {shown.feed}</b>
        <small>of {shown.follower.dropId}</small>
        <Badge tone={tone}>{verdict}</Badge>
      </header>
      <p>{motionWords(shown)}</p>
      {shown.place !== null && at !== null && (
        <p>
          {distance(metresBetween(at, shown.place))} from {vehicle} by now.
        </p>
      )}
      <p>{followedWords(shown, serviceNow(world.value.serviceAhead_s))}</p>
    </article>
  );
}
