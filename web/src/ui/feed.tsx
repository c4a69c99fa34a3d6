import { useMemo, useState } from "preact/hooks";
import { sentence } from "../format/sentences";
import { clockTime, fullTime } from "../format/units";
import { quietSeqs } from "../state/quiet";
import { feed } from "../state/store";
import { selectRun } from "../state/selection";
import type { StreamEvent } from "../api/types";

/** Rows drawn at first; more on request, up to all that is kept. */
const PAGE = 80;

export function Feed() {
  const [rows, setRows] = useState(PAGE);
  const all = feed.value;
  const [every, setEvery] = useState(false);
  const shown = useMemo(() => all.slice(0, rows), [all, rows]);
  const quiet = useMemo(() => quietSeqs(all), [all]);
  return (
    <section class="card feed" aria-labelledby="feed-title">
      <h2 id="feed-title">
        Events <small>{all.length}</small>
        <button type="button" class="toggle" aria-pressed={every} onClick={() => setEvery(!every)}>
          Show every event
        </button>
      </h2>
      {all.length === 0 && <p class="empty">Nothing has happened yet.</p>}
      <ol class="rows" tabIndex={0} aria-labelledby="feed-title">
        {shown.map((event) => (
          <FeedRow key={event.seq} event={event} hidden={!every && quiet.has(event.seq)} />
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

function FeedRow({ event, hidden }: { event: StreamEvent; hidden: boolean }) {
  const { text, tone } = sentence(event);
  const run = event.run_id;
  return (
    <li class={`event tone-${tone}`} data-seq={event.seq} data-kind={event.kind} hidden={hidden}>
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
