import { useMemo, useState } from "preact/hooks";
import type { StreamEvent } from "../../api/types";
import { countOf, joinParts, shortId, shortName } from "../../format/text";
import { formatMoment, formatTimestamp } from "../../format/units";
import { planName } from "../../store/plans";
import { selectedRun, selectRun, vehicleId } from "../../store/selection";
import { feed, today } from "../../store/store";
import { type EventGroup, groupEvents } from "./event-groups";
import { FEED_FILTERS, type FeedFilter, matchesFilter } from "./filter";
import { type EventText, formatEvent, planNameIn } from "./format-event";
import { formatEventGroup } from "./format-event-group";

/** Rows drawn at first; more on request, up to all that is kept. */
const PAGE = 80;

/** What happened: a line for each group, with its events on request, or every event. */
export function Feed() {
  const [rows, setRows] = useState(PAGE);
  const [filter, setFilter] = useState<FeedFilter>("highlights");
  const all = feed.value;
  const vehicle = vehicleId.value;
  const run = selectedRun.value?.id ?? null;
  const groups = useMemo(() => groupEvents(all), [all]);
  const wanted = useMemo(
    () => groups.filter((group) => matchesFilter(group, filter, { vehicle, run })),
    [groups, filter, vehicle, run],
  );
  const count = filter === "all" ? all.length : wanted.length;
  return (
    <section class="card feed" aria-labelledby="feed-title">
      <h2 id="feed-title">
        Events <small>{all.length}</small>
        <FilterChoice filter={filter} onChange={setFilter} />
      </h2>
      {count === 0 && <p class="empty">{all.length === 0 ? "No events yet." : "No matching events."}</p>}
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls must be reachable by keyboard */}
      <ol class="rows" tabIndex={0} aria-labelledby="feed-title">
        {filter === "all"
          ? all.slice(0, rows).map((event) => <EventRow key={event.position} event={event} />)
          : wanted.slice(0, rows).map((group) => <EventGroupRow key={group.key} group={group} />)}
      </ol>
      {count > rows && (
        <button type="button" class="more" onClick={() => setRows(rows + PAGE)}>
          Show older events
        </button>
      )}
    </section>
  );
}

function FilterChoice({ filter, onChange }: { filter: FeedFilter; onChange: (filter: FeedFilter) => void }) {
  const vehicle = vehicleId.value;
  return (
    <select
      class="small"
      aria-label="Filter events"
      value={filter}
      onChange={(event) => onChange(FEED_FILTERS.find((one) => one === event.currentTarget.value) ?? "highlights")}
    >
      <option value="highlights">Highlights</option>
      <option value="run" disabled={selectedRun.value === null}>
        Of the selected run
      </option>
      <option value="vehicle" disabled={vehicle === null}>
        {vehicle === null ? "Of the selected vehicle" : `Of ${vehicle}`}
      </option>
      <option value="delivery">Commands and drops</option>
      <option value="problems">Problems</option>
      <option value="service">Service</option>
      <option value="all">All events</option>
    </select>
  );
}

/** One sentence for all events of a group, and the events themselves on request. */
function EventGroupRow({ group }: { group: EventGroup }) {
  const [open, setOpen] = useState(false);
  const { events, head } = group;
  const words = formatEventGroup(group, planName);
  if (events.length === 1) return <EventRow event={head} words={words} />;
  const count = countOf(events.length, "event");
  return (
    <li class={`event-group tone-${words.tone}`} data-event-group={group.key}>
      <div class="event-line">
        <BriefTime event={head} />
        <i />
        <EventSentence event={head} text={words.text} />
        <button
          type="button"
          class="event-group-count"
          aria-expanded={open}
          aria-label={`${count}: ${words.text}`}
          title={open ? "Hide the events" : `Show ${count}`}
          onClick={() => setOpen(!open)}
        >
          {events.length}
        </button>
      </div>
      {open && (
        <ol class="event-group-events">
          {events.map((event) => (
            <EventRow key={event.position} event={event} />
          ))}
        </ol>
      )}
    </li>
  );
}

/** `words`: those of its group, which it is alone. */
function EventRow({ event, words }: { event: StreamEvent; words?: EventText }) {
  const { text, tone } = words ?? formatEvent(event, planName);
  return (
    <li class={`event event-line tone-${tone}`} data-seq={event.position} data-kind={event.kind}>
      {words === undefined ? (
        <time title={timeTitle(event)}>{formatMoment(event.time, today.value)}</time>
      ) : (
        <BriefTime event={event} />
      )}
      <i />
      <EventSentence
        event={event}
        text={words === undefined && isNamed(event) ? `${text} ${shortId(event.run_id)}` : text}
      />
    </li>
  );
}

/** Hours and minutes, after the date if it is not today: the lines of a story are short. */
function BriefTime({ event }: { event: StreamEvent }) {
  return <time title={timeTitle(event)}>{formatMoment(event.time, today.value).slice(0, -3)}</time>;
}

function timeTitle(event: StreamEvent): string {
  return `${formatTimestamp(event.time)} · event ${event.position}`;
}

/** The title has the whole of a name that is too long for the sentence. */
function EventSentence({ event, text }: { event: StreamEvent; text: string }) {
  const run = event.run_id;
  const name = planNameIn(event, planName);
  const long = name === null || shortName(name) === name ? "" : `“${name}”`;
  if (run === null) return <span title={long || undefined}>{text}</span>;
  return (
    <button type="button" class="plain" title={joinParts([long, `Show run ${run}`])} onClick={() => selectRun(run)}>
      {text}
    </button>
  );
}

/** The title names the run: plans may share a name. */
function isNamed(event: StreamEvent): boolean {
  return event.kind.startsWith("run.") && planNameIn(event, planName) !== null;
}
