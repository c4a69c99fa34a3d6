import { asSentence } from "../format/labels";
import { pageWords } from "../format/page-words";
import { dismiss, notices } from "../store/notices";
import { Icon } from "../ui/icons";

/** Problems in words: what was tried, what is wrong, how to mend it, and the code to look up. */
export function Notices() {
  return (
    <div class="notices" role="alert">
      {notices.value.map(({ id, doing, problem }) => (
        <article key={id} class="notice">
          <Icon name="error" />
          <div>
            <b>{doing}</b>
            <p>
              {problem.title}
              {problem.detail !== "" && `. ${asSentence(problem.detail)}`}
            </p>
            {problem.hint !== "" && <p class="hint">{asSentence(pageWords(problem.hint))}</p>}
            <code>{problem.code}</code>
          </div>
          <button type="button" class="icon-button" aria-label={`Dismiss: ${doing}`} onClick={() => dismiss(id)}>
            <Icon name="close" size={16} />
          </button>
        </article>
      ))}
    </div>
  );
}
