import { useEffect, useRef, useState } from "preact/hooks";
import { status } from "../store/store";
import { enterToken, tokenAsked } from "../store/sync";

/** What a websocket subprotocol may hold: anything else could not be sent. */
const TOKEN = /^[A-Za-z0-9._~+-]+$/;

const REJECTED = "The token was rejected: it is unknown, expired or revoked.";

export function TokenDialog() {
  const dialog = useRef<HTMLDialogElement>(null);
  const [text, setText] = useState("");
  const [problem, setProblem] = useState("");
  const asked = tokenAsked.value;
  const rejected = status.value.kind === "token_needed" && status.value.rejected ? REJECTED : "";

  useEffect(() => {
    if (asked > 0 && dialog.current?.open === false) dialog.current.showModal();
  }, [asked]);

  const submit = (event: Event) => {
    event.preventDefault();
    const token = text.trim();
    if (!TOKEN.test(token)) return setProblem("A token has only letters, digits and . _ ~ + -");
    setProblem("");
    setText("");
    dialog.current?.close();
    enterToken(token);
  };

  return (
    <dialog ref={dialog} class="dialog" aria-labelledby="token-title">
      <form onSubmit={submit}>
        <h2 id="token-title">Authentication required</h2>
        <p>
          Paste an access token. The page keeps it in this tab only. Create one with <code>waydrop token create</code>.
        </p>
        <label>
          Access token
          <input
            type="password"
            autoComplete="off"
            value={text}
            onInput={(event) => setText(event.currentTarget.value)}
          />
        </label>
        {(problem || rejected) !== "" && (
          <p class="form-problem" role="alert">
            {problem || rejected}
          </p>
        )}
        <button type="submit" class="primary">
          Connect
        </button>
      </form>
    </dialog>
  );
}
