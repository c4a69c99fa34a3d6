/** Which events of the feed say nothing new, so that they are shown only to whoever asks for every event. Pure. */

import type { StreamEvent } from "../api/types";
import { reasonWords } from "../format/reasons";

/** The seqs of quiet events. `feed` is newest first, as the world keeps it. */
export function quietSeqs(feed: readonly StreamEvent[]): ReadonlySet<number> {
  const said = new Map<string, string>();
  const quiet = new Set<number>();
  for (const event of feed.toReversed()) {
    const news = newsOf(event);
    if (event.kind === "run.item_ended") quiet.add(event.seq); // the run's table says it better
    if (news === null) continue;
    const subject = `${event.kind} ${event.run_id} ${news.about}`;
    if (said.get(subject) === news.text) quiet.add(event.seq);
    said.set(subject, news.text);
  }
  return quiet;
}

/** What an event says and about what; null for kinds of which each one is news. */
function newsOf(event: StreamEvent): { about: string; text: string } | null {
  switch (event.kind) {
    case "run.changed": {
      const { state, reason } = event.data;
      return { about: "", text: `${state} ${reasonWords(reason)}` };
    }
    case "run.drop": {
      const drop = event.data;
      return { about: drop.plan_item_id, text: [drop.phase, drop.outcome, drop.certainty, reasonWords(drop.reason), drop.output_evidence ?? ""].join(" ") };
    }
    case "run.upload_progress": {
      const { mission_type: list, sent, total, attempt } = event.data;
      return { about: list, text: sent === total ? "done" : `try ${attempt}` };
    }
    default:
      return null;
  }
}
