import { useState } from "preact/hooks";
import { offboardNow } from "../state/hands-on";
import { handOver } from "../state/hands-session";
import { knownNames } from "../state/pilots";
import { HoldButton } from "./hold-button";
import { PassingButton } from "./passing-button";

/** Let somebody else take the lease over. The vehicle is flown on from here until that one takes it. */
export function OffboardOffer({ vehicle }: { vehicle: string }) {
  const offered = offboardNow.value?.lease?.offered_to ?? null;
  return (
    <section class="hand-over" aria-label={`Hand ${vehicle} over`}>
      {offered === null ? (
        <Offer vehicle={vehicle} />
      ) : (
        <p role="status">
          <span>
            Offered to <b>{offered}</b>, who can take {vehicle} over on the Manual control panel. Until then it is yours.
          </span>
          <PassingButton name="Take the offer back" onClick={() => void handOver(null)} />
        </p>
      )}
    </section>
  );
}

const MAX_NAME_CHARS = 100;

function Offer({ vehicle }: { vehicle: string }) {
  const [typed, setTyped] = useState("");
  const name = typed.trim();
  return (
    <details>
      <summary>Hand {vehicle} over</summary>
      <label>
        <span>To whom (the name of their token)</span>
        <input type="text" list="pilot-names" autocomplete="off" maxLength={MAX_NAME_CHARS} value={typed} onInput={(event) => setTyped(event.currentTarget.value)} />
      </label>
      <datalist id="pilot-names">
        {knownNames.value.map((known) => (
          <option key={known} value={known} />
        ))}
      </datalist>
      <HoldButton verb={name === "" ? "Offer" : `Offer ${name} the lease of`} vehicle={vehicle} tone="warn" disabled={name === ""} onConfirm={() => void handOver(name)} />
    </details>
  );
}
