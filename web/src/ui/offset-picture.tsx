import type { DropRecord } from "../api/types";
import { distance } from "../format/units";
import { offsetOf, pictureRadius } from "../plan/offset";

/** The point, what the plan allows around it, and where the parcel left. North is up. */
export function OffsetPicture({ drop, allowed_m }: { drop: DropRecord; allowed_m: number | null }) {
  const offset = offsetOf(drop);
  if (offset === null) return null;
  const radius_m = pictureRadius(offset, allowed_m);
  const at = (metres: number) => (metres / radius_m) * 40;
  const words = `The parcel left ${side(offset.north_m, "north", "south")} and ${side(offset.east_m, "east", "west")} of the point${allowed_m === null ? "" : `; ${distance(allowed_m)} are allowed`}. The ring has a radius of ${distance(radius_m)}.`;
  return (
    <figure class="offset-picture">
      <svg viewBox="-48 -48 96 96" role="img" aria-label={words}>
        <circle class="offset-ring" r={40} />
        {allowed_m !== null && <circle class="offset-allowed" r={at(allowed_m)} />}
        <path class="offset-cross" d="M-4 0H4M0-4V4" />
        <path class="offset-line" d={`M0 0L${at(offset.east_m)} ${-at(offset.north_m)}`} />
        <circle class="offset-release" cx={at(offset.east_m)} cy={-at(offset.north_m)} r={4} />
        <path class="offset-north" d="M0-48L3-41H-3Z" />
      </svg>
      <figcaption>
        <small>ring {distance(radius_m)}</small>
      </figcaption>
    </figure>
  );
}

function side(metres: number, plus: string, minus: string): string {
  return `${distance(Math.abs(metres))} ${metres >= 0 ? plus : minus}`;
}
