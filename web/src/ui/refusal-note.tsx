import { pageWords } from "../format/page-words";
import { asSentence } from "../format/words";
import type { Refusal } from "../hands-on/refusal";

/** What was asked and not done, with the reason. */
export function RefusalNote({ refusal }: { refusal: Refusal }) {
  return (
    <div class="offboard-note tone-danger" role="alert">
      <b>{refusal.doing}: refused</b>
      <p>{asSentence(refusal.detail)}.</p>
      {refusal.hint !== "" && <p>{asSentence(pageWords(refusal.hint))}.</p>}
      <code>{refusal.code}</code>
    </div>
  );
}
