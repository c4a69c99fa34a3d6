import { useMemo, useState } from "preact/hooks";
import type { StreamEvent } from "../../api/types";
import { clockTime, fullTime } from "../../format/units";
import { planName } from "../../store/plans";
import { selectRun, vehicleId } from "../../store/selection";
import { feed } from "../../store/store";
import { FEEDS, type FeedChoice, isWanted, quietSeqs } from "./filter";
import { sentence, short } from "./format-event";

/** Rows drawn at first; more on request, up to all that is kept. */
const PAGE = 80;

export function Feed() {
  const [rows, setRows] = useState(PAGE);
  const all = feed.value;
  const [choice, setChoice] = useState<FeedChoice>("news");
  const vehicle = vehicleId.value;
  const wanted = useMemo(
    () => (choice === "all" || choice === "news" ? all : all.filter((event) => isWanted(event, choice, vehicle))),
    [all, choice, vehicle],
  );
  const shown = useMemo(() => wanted.slice(0, rows), [wanted, rows]);
  const quiet = useMemo(() => quietSeqs(all), [all]);
  return (
    <section class="card feed" aria-labelledby="feed-title">
      <h2 id="feed-title">
        Events <small>{all.length}</small>
        <select
          class="small"
          aria-label="Which events"
          value={choice}
          onChange={(event) => setChoice(FEEDS.find((one) => one === event.currentTarget.value) ?? "news")}
        >
          <option value="news">News</option>
          <option value="all">Every event</option>
          <option value="vehicle" disabled={vehicle === null}>
            {vehicle === null ? "Of the chosen vehicle" : `Of ${vehicle}`}
          </option>
          <option value="delivery">Commands and drops</option>
          <option value="problems">Problems</option>
        </select>
      </h2>
      {wanted.length === 0 && (
        <p class="empty">{all.length === 0 ? "Nothing has happened yet." : "Nothing like that has happened."}</p>
      )}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reachable by keyboard */}
      <ol class="rows" tabIndex={0} aria-labelledby="feed-title">
        {shown.map((event) => (
          <FeedRow key={event.position} event={event} hidden={choice === "news" && quiet.has(event.position)} />
        ))}
      </ol>
      {wanted.length > rows && (
        <button type="button" class="more" onClick={() => setRows(rows + PAGE)}>
          Show older events
        </button>
      )}
    </section>
  );
}

/** Its run is told by the name of its plan, which others may have too. */
function isNamed(event: StreamEvent): boolean {
  switch (event.kind) {
    case "run.created":
    case "run.changed":
    case "run.continued":
      return planName(event.data.plan_id) !== null;
    default:
      return false;
  }
}

function FeedRow({ event, hidden }: { event: StreamEvent; hidden: boolean }) {
  const { text, tone } = sentence(event, planName);
  const run = event.run_id;
  return (
    <li class={`event tone-${tone}`} data-seq={event.position} data-kind={event.kind} hidden={hidden}>
      <time title={`${fullTime(event.time)} · event ${event.position}`}>{clockTime(event.time)}</time>
      <i />
      {run === null ? (
        <span>{text}</span>
      ) : (
        <button type="button" class="plain" title={`Show run ${run}`} onClick={() => selectRun(run)}>
          {text}
          {isNamed(event) && <small class="run-id"> {short(run)}</small>}
        </button>
      )}
    </li>
  );
}
