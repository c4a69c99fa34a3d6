import { useState } from "preact/hooks";
import { api } from "../api/client";
import { altitude, distance, percent, speed } from "../format/units";
import { secondsLeft, type Question } from "../state/consents";
import { serviceNow } from "../state/clock";
import { report } from "../state/notices";
import { may } from "../state/principal";
import { dispatch, live, world } from "../state/store";
import { HoldButton } from "./hold-button";

/** A drop that asks: which vehicle, what was checked, how long; the release is held to confirm, the refusal is one press. */
export function ConsentCard({ question: { run, drop, consent } }: { question: Question }) {
  const [busy, setBusy] = useState(false);
  const left_s = secondsLeft(consent, serviceNow(world.value.serviceAhead_s));
  const whole_s = consent.deadline_at === null || consent.asked_at === null ? null : consent.deadline_at - consent.asked_at;
  const disabled = busy || !live.value || left_s === 0 || !may("pilot");
  const answer = async (grant: boolean) => {
    setBusy(true);
    try {
      dispatch({ type: "run_read", run: await api.answerConsent(run.id, drop.plan_item_id, grant, consent.question) });
    } catch (error) {
      report(`${grant ? "Consent to" : "Refuse"} ${drop.plan_item_id} of ${run.vehicle_id}`, error);
    } finally {
      setBusy(false);
    }
  };
  return (
    <section class="consent-card tone-drop" aria-label={`${run.vehicle_id} asks for consent to ${drop.plan_item_id}`}>
      <header>
        <h4>
          {run.vehicle_id} holds at “{drop.plan_item_id}”. Release?
        </h4>
        <b class="countdown" role="timer">
          {left_s === null ? "" : `${Math.ceil(left_s)} s`}
        </b>
      </header>
      {left_s !== null && whole_s !== null && <progress max={whole_s} value={left_s} aria-label="Time left to answer" />}
      <p class="consent-checks">{checksOf(consent)}</p>
      <div class="actions">
        <HoldButton verb={`Release ${drop.plan_item_id} from`} vehicle={run.vehicle_id} tone="ok" disabled={disabled} onConfirm={() => void answer(true)} />
        <button type="button" class="refuse" disabled={disabled} onClick={() => void answer(false)}>
          Keep it on board
        </button>
      </div>
      <small>{may("pilot") ? "No answer in time keeps it on board. All checks are made once more before the release." : "Only a pilot can answer. No answer in time keeps it on board."}</small>
    </section>
  );
}

/** What was measured when it was asked. */
function checksOf({ checked, question }: Question["consent"]): string {
  const parts = [
    question > 1 ? `asked for the ${question}. time` : "",
    checked == null ? "" : `${distance(checked.offset_m)} from the point`,
    checked == null ? "" : `${altitude(checked.relative_altitude_m)} high`,
    checked == null ? "" : `at ${speed(checked.ground_speed_m_s)}`,
    checked == null ? "" : `battery ${percent(checked.battery_percent)}`,
  ];
  return parts.filter((part) => part !== "").join(" · ");
}
