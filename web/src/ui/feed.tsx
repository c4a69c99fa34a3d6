import { useMemo, useState } from "preact/hooks";
import { sentence } from "../format/sentences";
import { clockTime, fullTime } from "../format/units";
import { feed } from "../state/store";
import { selectRun } from "../state/selection";
import type { StreamEvent } from "../api/types";

/** Rows drawn at first; more on request, up to all that is kept. */
const PAGE = 80;

export function Feed() {
  const [rows, setRows] = useState(PAGE);
  const all = feed.value;
  const shown = useMemo(() => all.slice(0, rows), [all, rows]);
  return (
    <section class="card feed" aria-labelledby="feed-title">
      <h2 id="feed-title">
        Events <small>{all.length}</small>
      </h2>
      {all.length === 0 && <p class="empty">Nothing has happened yet.</p>}
      <ol class="rows" tabIndex={0} aria-labelledby="feed-title">
        {shown.map((event) => (
          <FeedRow key={event.seq} event={event} />
        ))}
      </ol>
      {all.length > rows && (
        <button type="button" class="more" onClick={() => setRows(rows + PAGE)}>
          Show older events
        </button>
      )}
    </section>
  );
}

function FeedRow({ event }: { event: StreamEvent }) {
  const { text, tone } = sentence(event);
  const run = event.run_id;
  return (
    <li class={`event tone-${tone}`} data-seq={event.seq} data-kind={event.kind}>
      <time title={`${fullTime(event.time)} · event ${event.seq}`}>{clockTime(event.time)}</time>
      <i />
      {run === null ? (
        <span>{text}</span>
      ) : (
        <button type="button" class="plain" onClick={() => selectRun(run)}>
          {text}
        </button>
      )}
    </li>
  );
}
