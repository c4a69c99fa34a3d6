import { useMemo, useState } from "preact/hooks";
import type { StreamEvent } from "../../api/types";
import { shortId } from "../../format/text";
import { formatClock, formatTimestamp } from "../../format/units";
import { planName } from "../../store/plans";
import { selectRun, vehicleId } from "../../store/selection";
import { feed } from "../../store/store";
import { FEED_FILTERS, type FeedFilter, matchesFilter, repeatedSeqs } from "./filter";
import { formatEvent } from "./format-event";

/** Rows drawn at first; more on request, up to all that is kept. */
const PAGE = 80;

export function Feed() {
  const [rows, setRows] = useState(PAGE);
  const all = feed.value;
  const [filter, setFilter] = useState<FeedFilter>("highlights");
  const vehicle = vehicleId.value;
  const wanted = useMemo(
    () =>
      filter === "all" || filter === "highlights" ? all : all.filter((event) => matchesFilter(event, filter, vehicle)),
    [all, filter, vehicle],
  );
  const shown = useMemo(() => wanted.slice(0, rows), [wanted, rows]);
  const repeated = useMemo(() => repeatedSeqs(all), [all]);
  return (
    <section class="card feed" aria-labelledby="feed-title">
      <h2 id="feed-title">
        Events <small>{all.length}</small>
        <select
          class="small"
          aria-label="Filter events"
          value={filter}
          onChange={(event) => setFilter(FEED_FILTERS.find((one) => one === event.currentTarget.value) ?? "highlights")}
        >
          <option value="highlights">Highlights</option>
          <option value="all">All events</option>
          <option value="vehicle" disabled={vehicle === null}>
            {vehicle === null ? "Of the selected vehicle" : `Of ${vehicle}`}
          </option>
          <option value="delivery">Commands and drops</option>
          <option value="problems">Problems</option>
        </select>
      </h2>
      {wanted.length === 0 && <p class="empty">{all.length === 0 ? "No events yet." : "No matching events."}</p>}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reachable by keyboard */}
      <ol class="rows" tabIndex={0} aria-labelledby="feed-title">
        {shown.map((event) => (
          <FeedRow
            key={event.position}
            event={event}
            hidden={filter === "highlights" && repeated.has(event.position)}
          />
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

/** The title names the run: plans may share a name. */
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
  const { text, tone } = formatEvent(event, planName);
  const run = event.run_id;
  return (
    <li class={`event tone-${tone}`} data-seq={event.position} data-kind={event.kind} hidden={hidden}>
      <time title={`${formatTimestamp(event.time)} · event ${event.position}`}>{formatClock(event.time)}</time>
      <i />
      {run === null ? (
        <span>{text}</span>
      ) : (
        <button type="button" class="plain" title={`Show run ${run}`} onClick={() => selectRun(run)}>
          {text}
          {isNamed(event) && <small class="run-id"> {shortId(run)}</small>}
        </button>
      )}
    </li>
  );
}
