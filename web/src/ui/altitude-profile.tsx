import type { Timeline } from "../api/types";
import { altitude, seconds } from "../format/units";
import { profileOf, profilePath, profileXY, type Profile, type ProfilePoint } from "../plan/profile";
import { itemId } from "../state/selection";

const WIDTH = 400;
const HEIGHT = 100;

/** How high the vehicle is predicted to fly, over time; items and drops stand on the line. */
export function AltitudeProfile({ timeline, numberOf }: { timeline: Timeline | null; numberOf: (itemId: string) => number | null }) {
  const profile = profileOf(timeline);
  if (profile === null) return null;
  const words = `Altitude over time: up to ${altitude(profile.high_m)} above home, ${seconds(Math.round(profile.end_s))}`;
  return (
    <figure class="profile" role="img" aria-label={words}>
      <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} preserveAspectRatio="none" aria-hidden="true">
        <path class="profile-fill" d={profilePath(profile, WIDTH, HEIGHT, true)} />
        <path class="profile-line" d={profilePath(profile, WIDTH, HEIGHT, false)} />
      </svg>
      {profile.points.map((point) => (
        <Mark key={`${point.itemId} ${point.at_s}`} profile={profile} point={point} kind={itemId.value === point.itemId ? "pointed" : ""} text={numberOf(point.itemId)} />
      ))}
      {profile.drops.map((drop) => (
        <Mark key={`${drop.itemId} ${drop.at_s}`} profile={profile} point={drop} kind="drop" text={null} />
      ))}
      <span class="profile-top">{altitude(profile.high_m)}</span>
      <span class="profile-start">0 s</span>
      <span class="profile-end">{seconds(Math.round(profile.end_s))}</span>
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
  return (
    <i class={`profile-mark ${kind}`} style={{ left: `${x * 100}%`, top: `${y * 100}%` }} title={`${point.itemId}: ${altitude(point.relative_altitude_m)} after ${seconds(Math.round(point.at_s))}`}>
      {text}
    </i>
  );
}
