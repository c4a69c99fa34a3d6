import { toSentence, toSentences } from "../format/text";
import { dismiss, notices } from "../store/notices";
import { Icon } from "../ui/icons";

/** Problems, the newest first: what was tried, what is wrong, how to solve it, and the code to look up. */
export function Notices() {
  return (
    <div class="notices" role="alert">
      {notices.value.toReversed().map(({ id, action, problem }) => (
        <article key={id} class="notice">
          <Icon name="error" />
          <div>
            <b>{action}</b>
            <p>{toSentences(problem.title, problem.detail)}</p>
            {problem.hint !== "" && <p class="hint">{toSentence(problem.hint)}</p>}
            <code>{problem.code}</code>
          </div>
          <button type="button" class="icon-button" aria-label={`Dismiss: ${action}`} onClick={() => dismiss(id)}>
            <Icon name="close" size={16} />
          </button>
        </article>
      ))}
    </div>
  );
}
