import type { DropRecord } from "../../api/types";
import { asSentence, certaintyName, consentWords, dropName, dropTone, outputWords, plain } from "../../format/labels";
import { reasonWords } from "../../format/reasons";
import { age, clockTime, distance, fullTime, roundDistance, speed } from "../../format/units";
import { Badge } from "../../ui/badge";
import { DropAttachments } from "./attachment-list";

/** One drop with its evidence. What was sent, answered, put out and sensed are four facts, and stay four. */
export function DropCard({ run, drop, allowed_m }: { run: string; drop: DropRecord; allowed_m: number | null }) {
  return (
    <article class={`drop-card tone-${dropTone(drop)}`} aria-label={`Drop ${drop.plan_item_id}`}>
      <header>
        <b>{drop.plan_item_id}</b>
        <small>{kindOf(drop)}</small>
        <Badge tone={dropTone(drop)}>{drop.outcome === "pending" ? plain(drop.phase) : dropName(drop)}</Badge>
      </header>
      <ol class="evidence">
        <Evidence
          name="Commanded"
          at={drop.commanded_at}
          note={drop.attempts > 1 ? `${drop.attempts} tries` : ""}
          missing={drop.supervised ? "not sent" : "by the mission"}
        />
        <Evidence
          name="Acknowledged"
          at={drop.acknowledged_at}
          note={(drop.acknowledged_result ?? "").replaceAll("_", " ").toLowerCase()}
          missing={drop.supervised ? "no answer" : "no answer comes"}
        />
        <Evidence
          name="Output"
          at={drop.output_at}
          note={drop.output_us === null ? "" : `${drop.output_us} µs`}
          missing={outputWords(drop.output_evidence) || "not seen"}
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
  if (alternate_to !== null) return `instead of ${alternate_to}`;
  return supervised ? "supervised" : "embedded in the mission";
}

/** How certain it is, where and how fast the vehicle was, and why. */
function DropResult({ drop }: { drop: DropRecord }) {
  const { consent, target, reason, offset_m, ground_speed_m_s } = drop;
  const facts = [
    plain(certaintyName(drop.certainty)),
    offset_m === null ? "" : `${distance(offset_m)} from the point`,
    ground_speed_m_s === null ? "" : `at ${speed(ground_speed_m_s)}`,
  ].filter((part) => part !== "");
  return (
    <div>
      {consent && consent.state !== "asked" && <p class="drop-result">{consentWords(consent)}</p>}
      {(drop.certainty !== "none" || offset_m !== null) && <p class="drop-result">{facts.join(" · ")}</p>}
      {target && <p class="drop-result">{targetText(target)}</p>}
      {drop.output_evidence === "not_assigned" && (
        <p class="drop-result tone-warn">
          No output is assigned to the gripper: its acknowledgement proves nothing. A gripper on CAN looks alike.
        </p>
      )}
      {reason !== null && <p class="drop-reason">{asSentence(reasonWords(reason))}</p>}
    </div>
  );
}

function targetText({ feed, distance_m, age_s }: NonNullable<DropRecord["target"]>): string {
  const away = distance_m === null ? "" : ` was ${distance(distance_m)} away`;
  return `Target ${feed}${away}, reported ${age(age_s)} before`;
}

function Evidence({ name, at, note, missing }: { name: string; at: number | null; note: string; missing: string }) {
  return (
    <li class={at === null ? "absent" : "present"}>
      <span>{name}</span>
      {at === null ? <small>{missing}</small> : <time title={fullTime(at)}>{clockTime(at)}</time>}
      {note !== "" && at !== null && <small>{note}</small>}
    </li>
  );
}

/** The point, what the plan allows around it, and where the parcel left. North is up. */
export function OffsetPicture({ drop, allowed_m }: { drop: DropRecord; allowed_m: number | null }) {
  const offset = offsetOf(drop);
  if (offset === null) return null;
  const radius_m = pictureRadius(offset, allowed_m);
  const at = (metres: number) => (metres / radius_m) * 40;
  const left = `The parcel left ${side(offset.north_m, "north", "south")} and ${side(offset.east_m, "east", "west")} of the point`;
  const allowed = allowed_m === null ? "" : `; ${distance(allowed_m)} are allowed`;
  const words = `${left}${allowed}. The ring has a radius of ${distance(radius_m)}.`;
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

// Where a parcel left beside where it should: east and north of the planned point, and how large to draw it. Pure.

const METRES_PER_DEGREE = 111_195;

export interface Offset {
  readonly east_m: number;
  readonly north_m: number;
}

/** Null if either place is not known. */
export function offsetOf(drop: DropRecord): Offset | null {
  const { planned_latitude_deg: lat0, planned_longitude_deg: lon0, latitude_deg: lat, longitude_deg: lon } = drop;
  if (lat0 === null || lon0 === null || lat === null || lon === null) return null;
  return {
    east_m: (lon - lon0) * METRES_PER_DEGREE * Math.cos((lat0 * Math.PI) / 180),
    north_m: (lat - lat0) * METRES_PER_DEGREE,
  };
}

/** The radius of the picture's ring: round, around the release, and around what was allowed. */
export function pictureRadius({ east_m, north_m }: Offset, allowed_m: number | null): number {
  return roundDistance(Math.max(1, Math.hypot(east_m, north_m), allowed_m ?? 0) * 1.02);
}
