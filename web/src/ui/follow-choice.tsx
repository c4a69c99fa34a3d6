import { motionWords } from "../format/target-words";
import { secondsSince } from "../state/clock";
import { changeForm, taskForm } from "../state/task-draft";
import { reports, seenIn } from "../state/target-reports";
import { Choice } from "./choice";

/** A place on the map, or one of the moving targets that report. Nothing while there are none. */
export function FollowChoice() {
  const { follow } = taskForm.value;
  const read = reports.value;
  const feeds = Object.keys(read?.targets ?? {});
  if (feeds.length === 0 && follow === null) return null;
  const all = follow === null || feeds.includes(follow) ? feeds : [follow, ...feeds];
  return (
    <div class="task-follow">
      <Choice name="Where to" value={follow ?? ""} onChange={(feed) => changeForm(feed === "" ? { follow: null } : { follow: feed, gripper: null, stay: false })}>
        <option value="">A place on the map</option>
        {all.map((feed) => (
          <option key={feed} value={feed}>
            Follow {feed}
          </option>
        ))}
      </Choice>
      {follow !== null && read !== null && <small class="hint">{motionWords(seenIn(read, follow, secondsSince(read.at)))}</small>}
    </div>
  );
}
