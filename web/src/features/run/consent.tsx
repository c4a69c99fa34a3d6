import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { ConsentRecord, DropRecord, Run } from "../../api/types";
import { altitude, distance, percent, speed } from "../../format/units";
import { serviceNow } from "../../store/clock";
import { report } from "../../store/notices";
import { may } from "../../store/principal";
import { isOver } from "../../store/runs";
import { panel, selectedRun, selectRun, showView, view } from "../../store/selection";
import { dispatch, live, runs, world } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";

/**
 * A drop that asks: which vehicle, what was checked, how long; the release is held to confirm, the refusal is one
 * press.
 */
export function ConsentCard({ question: { run, drop, consent } }: { question: Question }) {
  const [busy, setBusy] = useState(false);
  const left_s = secondsLeft(consent, serviceNow(world.value.serviceAhead_s));
  const whole_s =
    consent.deadline_at === null || consent.asked_at === null ? null : consent.deadline_at - consent.asked_at;
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
      {left_s !== null && whole_s !== null && (
        <progress max={whole_s} value={left_s} aria-label="Time left to answer" />
      )}
      <p class="consent-checks">{checksOf(consent)}</p>
      <div class="actions">
        <HoldButton
          verb={`Release ${drop.plan_item_id} from`}
          vehicle={run.vehicle_id}
          tone="ok"
          disabled={disabled}
          onConfirm={() => void answer(true)}
        />
        <button type="button" class="refuse" disabled={disabled} onClick={() => void answer(false)}>
          Keep it on board
        </button>
      </div>
      <small>
        {may("pilot")
          ? "No answer in time keeps it on board. All checks are made once more before the release."
          : "Only a pilot can answer. No answer in time keeps it on board."}
      </small>
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

/** Questions that are not on the screen: whoever looks at another run, or at the plan, is called. */
export function ConsentCalls() {
  const shown = panel.value === "run" ? selectedRun.value?.id : undefined;
  const narrow = view.value !== "run" && matchMedia("(max-width: 1099px)").matches;
  const calls = openQuestions(runs.value).filter(({ run }) => run.id !== shown || narrow);
  if (calls.length === 0) return null;
  const now_s = serviceNow(world.value.serviceAhead_s);
  return (
    <div class="notices consent-calls" role="alert">
      {calls.map(({ run, drop, consent }) => {
        const left_s = secondsLeft(consent, now_s);
        const show = () => {
          selectRun(run.id);
          if (narrow) showView("run");
        };
        return (
          <article key={`${run.id} ${drop.plan_item_id}`} class="notice call">
            <Icon name="warning" />
            <div>
              <b>{run.vehicle_id} waits for your consent</b>
              <p>
                “{drop.plan_item_id}”
                <span aria-hidden="true">{left_s === null ? "" : `, ${Math.ceil(left_s)} s left`}</span>
              </p>
            </div>
            <button type="button" class="small" aria-label={`Show what ${run.vehicle_id} asks`} onClick={show}>
              Show
            </button>
          </article>
        );
      })}
    </div>
  );
}

// Which drops wait for an operator's consent, and how long they still do. Pure.

/** A question that can be answered: the vehicle holds at its drop and waits. */
export interface Question {
  readonly run: Run;
  readonly drop: DropRecord;
  readonly consent: ConsentRecord;
}

/** Of one run, in the order of its drops. */
export function questionsOf(run: Run): Question[] {
  if (isOver(run)) return [];
  return run.drops.flatMap((drop) => (drop.consent?.state === "asked" ? [{ run, drop, consent: drop.consent }] : []));
}

/** Of all runs, the most urgent first. */
export function openQuestions(runs: Readonly<Record<string, Run>>): Question[] {
  const all = Object.values(runs).flatMap(questionsOf);
  return all.sort((a, b) => (a.consent.deadline_at ?? Infinity) - (b.consent.deadline_at ?? Infinity));
}

/** Seconds that are left to answer, by the service's clock; null if one of the two is not known. */
export function secondsLeft(consent: ConsentRecord, serviceNow_s: number | null): number | null {
  return consent.deadline_at === null || serviceNow_s === null ? null : Math.max(0, consent.deadline_at - serviceNow_s);
}
