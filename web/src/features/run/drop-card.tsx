import type { DropRecord } from "../../api/types";
import { certaintyLabel, dropLabel, dropTone, formatConsent, outputLabel } from "../../format/labels";
import { resultLabel } from "../../format/mavlink";
import { formatReason } from "../../format/reasons";
import { capitalize } from "../../format/text";
import {
  formatAge,
  formatDistance,
  formatMoment,
  formatSpeed,
  formatTimestamp,
  roundDistance,
} from "../../format/units";
import { today } from "../../store/store";
import { Badge } from "../../ui/badge";
import { DropAttachments } from "./attachment-list";

/** One drop with its evidence. What was sent, answered, put out and sensed are four facts, and stay four. */
export function DropCard({ run, drop, allowed_m }: { run: string; drop: DropRecord; allowed_m: number | null }) {
  return (
    <article class={`drop-card tone-${dropTone(drop)}`} aria-label={`Drop ${drop.plan_item_id}`}>
      <header>
        <b>{drop.plan_item_id}</b>
        <small>{kindOf(drop)}</small>
        <Badge tone={dropTone(drop)}>{dropLabel(drop)}</Badge>
      </header>
      <ol class="evidence">
        <Evidence
          name="Commanded"
          at={drop.commanded_at}
          note={drop.attempts > 1 ? `${drop.attempts} attempts` : ""}
          missing={drop.supervised ? "not sent" : "by the mission"}
        />
        <Evidence
          name="Acknowledged"
          at={drop.acknowledged_at}
          note={drop.acknowledged_result === null ? "" : resultLabel(drop.acknowledged_result)}
          missing={!drop.supervised ? "none expected" : drop.commanded_at === null ? "not yet" : "no answer"}
        />
        <Evidence
          name="Output"
          at={drop.output_at}
          note={drop.output_us === null ? "" : `${drop.output_us} µs`}
          missing={outputLabel(drop.output_evidence) || "not observed"}
        />
        <Evidence name="Sensed" at={drop.sensed_at} note="" missing="no sensor report" />
      </ol>
      <div class="drop-where">
        <DropResult drop={drop} />
        <OffsetPicture drop={drop} allowed_m={allowed_m} />
      </div>
      <DropAttachments run={run} drop={drop.plan_item_id} />
    </article>
  );
}

function kindOf({ alternate_to, supervised }: DropRecord): string {
  if (alternate_to !== null) return `alternate of ${alternate_to}`;
  return supervised ? "supervised" : "embedded in the mission";
}

/** How certain it is, where and how fast the vehicle was, and why. */
function DropResult({ drop }: { drop: DropRecord }) {
  const { consent, target, reason, offset_m, ground_speed_m_s } = drop;
  const facts = [
    capitalize(certaintyLabel(drop.certainty)),
    offset_m === null ? "" : `${formatDistance(offset_m)} from the point`,
    ground_speed_m_s === null ? "" : `at ${formatSpeed(ground_speed_m_s)}`,
  ].filter((part) => part !== "");
  return (
    <div>
      {consent && consent.state !== "asked" && <p class="drop-result">{formatConsent(consent)}</p>}
      {(drop.certainty !== "none" || offset_m !== null) && <p class="drop-result">{facts.join(" · ")}</p>}
      {target && <p class="drop-result">{targetText(target)}</p>}
      {drop.output_evidence === "not_assigned" && (
        <p class="drop-result tone-warn">
          No output is assigned to the gripper, so its acknowledgement proves nothing. A CAN gripper looks the same.
        </p>
      )}
      {reason !== null && <p class="drop-reason">{capitalize(formatReason(reason))}</p>}
    </div>
  );
}

function targetText({ feed, distance_m, age_s }: NonNullable<DropRecord["target"]>): string {
  const away = distance_m === null ? "" : ` ${formatDistance(distance_m)} away`;
  return `Target ${feed}${away}, reported ${formatAge(age_s)} before the release`;
}

function Evidence({ name, at, note, missing }: { name: string; at: number | null; note: string; missing: string }) {
  return (
    <li class={at === null ? "absent" : "present"}>
      <span>{name}</span>
      {at === null ? (
        <small>{missing}</small>
      ) : (
        <time title={formatTimestamp(at)}>{formatMoment(at, today.value)}</time>
      )}
      {note !== "" && at !== null && <small>{note}</small>}
    </li>
  );
}

/** The point, what the plan allows around it, and where the parcel left. North is up. */
function OffsetPicture({ drop, allowed_m }: { drop: DropRecord; allowed_m: number | null }) {
  const offset = releaseOffset(drop);
  if (offset === null) return null;
  const radius_m = pictureRadius(offset, allowed_m);
  const at = (metres: number) => (metres / radius_m) * 40;
  const left = `Released ${side(offset.north_m, "north", "south")} and ${side(offset.east_m, "east", "west")} of the point`;
  const allowed = allowed_m === null ? "" : `; the limit is ${formatDistance(allowed_m)}`;
  const words = `${left}${allowed}. The ring has a radius of ${formatDistance(radius_m)}.`;
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
        <small>Radius {formatDistance(radius_m)}</small>
      </figcaption>
    </figure>
  );
}

function side(metres: number, plus: string, minus: string): string {
  return `${formatDistance(Math.abs(metres))} ${metres >= 0 ? plus : minus}`;
}

// Where a parcel left beside where it should: east and north of the planned point, and how large to draw it. Pure.

const METRES_PER_DEGREE = 111_195;

interface ReleaseOffset {
  readonly east_m: number;
  readonly north_m: number;
}

/** Null if either place is not known. */
export function releaseOffset(drop: DropRecord): ReleaseOffset | null {
  const { planned_latitude_deg: lat0, planned_longitude_deg: lon0, latitude_deg: lat, longitude_deg: lon } = drop;
  if (lat0 === null || lon0 === null || lat === null || lon === null) return null;
  return {
    east_m: (lon - lon0) * METRES_PER_DEGREE * Math.cos((lat0 * Math.PI) / 180),
    north_m: (lat - lat0) * METRES_PER_DEGREE,
  };
}

/** The radius of the picture's ring: round, around the release, and around what was allowed. */
export function pictureRadius({ east_m, north_m }: ReleaseOffset, allowed_m: number | null): number {
  return roundDistance(Math.max(1, Math.hypot(east_m, north_m), allowed_m ?? 0) * 1.02);
}
