import type { Timeline } from "../../api/types";
import { formatAltitude, formatDuration } from "../../format/units";
import { itemId } from "../../store/selection";

const WIDTH = 400;
const HEIGHT = 100;

/** How high the vehicle is predicted to fly, over time; items and drops stand on the line. */
export function AltitudeProfile({
  timeline,
  numberOf,
}: {
  timeline: Timeline | null;
  numberOf: (itemId: string) => number | null;
}) {
  const profile = profileOf(timeline);
  if (profile === null) return null;
  const words = `Altitude over time: up to ${formatAltitude(profile.high_m)} above home, ${formatDuration(Math.round(profile.end_s))}`;
  return (
    <figure class="profile" role="img" aria-label={words}>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} preserveAspectRatio="none" aria-hidden="true">
        <path class="profile-fill" d={profilePath(profile, WIDTH, HEIGHT, true)} />
        <path class="profile-line" d={profilePath(profile, WIDTH, HEIGHT, false)} />
      </svg>
      {profile.points.map((point) => (
        <Mark
          key={`${point.itemId} ${point.at_s}`}
          profile={profile}
          point={point}
          kind={itemId.value === point.itemId ? "pointed" : ""}
          text={numberOf(point.itemId)}
        />
      ))}
      {profile.drops.map((drop) => (
        <Mark key={`${drop.itemId} ${drop.at_s}`} profile={profile} point={drop} kind="drop" text={null} />
      ))}
      <span class="profile-top">{formatAltitude(profile.high_m)}</span>
      <span class="profile-start">0 s</span>
      <span class="profile-end">{formatDuration(Math.round(profile.end_s))}</span>
    </figure>
  );
}

interface MarkProps {
  profile: Profile;
  point: ProfilePoint;
  kind: string;
  text: number | null;
}

function Mark({ profile, point, kind, text }: MarkProps) {
  const [x, y] = profileXY(profile, point.at_s, point.relative_altitude_m);
  const altitude = formatAltitude(point.relative_altitude_m);
  return (
    <i
      class={`profile-mark ${kind}`}
      style={{ left: `${x * 100}%`, top: `${y * 100}%` }}
      title={`${point.itemId}: ${altitude} after ${formatDuration(Math.round(point.at_s))}`}
    >
      {text}
    </i>
  );
}

// The altitude profile that the service predicts: height above home over time. Pure.

interface ProfilePoint {
  readonly itemId: string;
  readonly at_s: number;
  readonly relative_altitude_m: number;
  readonly brakes: boolean;
}

interface Profile {
  /** From the start on the ground; each leg is straight between two of them. */
  readonly line: readonly (readonly [at_s: number, relative_altitude_m: number])[];
  /** The first visit of each item that is no drop: thousands of visits, as in loops, could not be told apart. */
  readonly points: readonly ProfilePoint[];
  readonly drops: readonly ProfilePoint[];
  readonly end_s: number;
  readonly low_m: number;
  readonly high_m: number;
}

/** Null if there is nothing to draw. */
export function profileOf(timeline: Timeline | null): Profile | null {
  if (timeline === null || timeline.entries.length === 0 || timeline.duration_s <= 0) return null;
  const line: [number, number][] = [[0, 0]];
  for (const entry of timeline.entries) {
    const [before_s, altitude_m] = line.at(-1) ?? [0, 0];
    if (entry.start_s > before_s) line.push([entry.start_s, altitude_m]);
    line.push([entry.end_s, entry.relative_altitude_m]);
  }
  const marked = new Set(timeline.drops.map(({ item_id }) => item_id)); // they have a mark of their own
  const points = timeline.entries
    .filter(({ item_id }) => marked.size < marked.add(item_id).size)
    .map(({ item_id, end_s, relative_altitude_m, brakes }) => ({
      itemId: item_id,
      at_s: end_s,
      relative_altitude_m,
      brakes,
    }));
  const drops = timeline.drops.map(({ item_id, at_s, relative_altitude_m, release_motion }) => ({
    itemId: item_id,
    at_s,
    relative_altitude_m,
    brakes: release_motion === "stopped",
  }));
  const heights = line.map(([, altitude_m]) => altitude_m);
  return {
    line,
    points,
    drops,
    end_s: Math.max(timeline.duration_s, line.at(-1)?.[0] ?? 0),
    low_m: Math.min(0, ...heights),
    high_m: Math.max(1, ...heights),
  };
}

/** The line as an SVG path in a box of `width` by `height`, closed along its bottom if `filled`. */
export function profilePath(profile: Profile, width: number, height: number, filled: boolean): string {
  const steps = profile.line.map(([at_s, altitude_m], i) => {
    const [x, y] = profileXY(profile, at_s, altitude_m);
    return `${i === 0 ? "M" : "L"}${(x * width).toFixed(1)} ${(y * height).toFixed(1)}`;
  });
  const end = ((profile.line.at(-1)?.[0] ?? 0) / profile.end_s) * width;
  return steps.join("") + (filled ? `L${end.toFixed(1)} ${height}L0 ${height}Z` : "");
}

/** Shares of the box: 0, 0 is its upper left corner. */
export function profileXY({ end_s, low_m, high_m }: Profile, at_s: number, altitude_m: number): [x: number, y: number] {
  return [at_s / end_s, 1 - (altitude_m - low_m) / (high_m - low_m)];
}
