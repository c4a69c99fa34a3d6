import type { DropRecord } from "../api/types";
import { reasonWords } from "../format/reasons";
import { age, clockTime, distance, fullTime, speed } from "../format/units";
import { asSentence, certaintyName, consentWords, dropName, dropTone, outputWords, plain } from "../format/words";
import { Badge } from "./badge";
import { DropAttachments } from "./drop-attachments";
import { OffsetPicture } from "./offset-picture";

/** One drop with its evidence. What was sent, answered, put out and sensed are four facts, and stay four. */
export function DropCard({ run, drop, allowed_m }: { run: string; drop: DropRecord; allowed_m: number | null }) {
  const certainty = certaintyName(drop.certainty);
  return (
    <article class={`drop-card tone-${dropTone(drop)}`} aria-label={`Drop ${drop.plan_item_id}`}>
      <header>
        <b>{drop.plan_item_id}</b>
        <small>{drop.alternate_to !== null ? `instead of ${drop.alternate_to}` : drop.supervised ? "supervised" : "embedded in the mission"}</small>
        <Badge tone={dropTone(drop)}>{drop.outcome === "pending" ? plain(drop.phase) : dropName(drop)}</Badge>
      </header>
      <ol class="evidence">
        <Evidence name="Commanded" at={drop.commanded_at} note={drop.attempts > 1 ? `${drop.attempts} tries` : ""} missing={drop.supervised ? "not sent" : "by the mission"} />
        <Evidence name="Acknowledged" at={drop.acknowledged_at} note={(drop.acknowledged_result ?? "").replaceAll("_", " ").toLowerCase()} missing={drop.supervised ? "no answer" : "no answer comes"} />
        <Evidence name="Output" at={drop.output_at} note={drop.output_us === null ? "" : `${drop.output_us} µs`} missing={outputWords(drop.output_evidence) || "not seen"} />
        <Evidence name="Sensed" at={drop.sensed_at} note="" missing="no sensor report" />
      </ol>
      <div class="drop-where">
        <div>
          {drop.consent && drop.consent.state !== "asked" && <p class="drop-result">{consentWords(drop.consent)}</p>}
          {(certainty !== "" || drop.offset_m !== null) && (
            <p class="drop-result">
              {[certainty === "" ? "" : plain(certainty), drop.offset_m === null ? "" : `${distance(drop.offset_m)} from the point`, drop.ground_speed_m_s === null ? "" : `at ${speed(drop.ground_speed_m_s)}`]
                .filter((part) => part !== "")
                .join(" · ")}
            </p>
          )}
          {drop.target && <p class="drop-result">{`Target ${drop.target.feed}${drop.target.distance_m === null ? "" : ` was ${distance(drop.target.distance_m)} away`}, reported ${age(drop.target.age_s)} before`}</p>}
          {drop.output_evidence === "not_assigned" && <p class="drop-result tone-warn">No output is assigned to the gripper: its acknowledgement proves nothing. A gripper on CAN looks alike.</p>}
          {drop.reason !== null && <p class="drop-reason">{asSentence(reasonWords(drop.reason))}</p>}
        </div>
        <OffsetPicture drop={drop} allowed_m={allowed_m} />
      </div>
      <DropAttachments run={run} drop={drop.plan_item_id} />
    </article>
  );
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
