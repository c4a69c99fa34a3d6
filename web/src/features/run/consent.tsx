import { useComputed } from "@preact/signals";
import { useState } from "preact/hooks";
import { api } from "../../api/client";
import type { ConsentRecord, DropRecord, Run } from "../../api/types";
import { formatAltitude, formatDistance, formatPercent, formatSpeed } from "../../format/units";
import { serviceNow } from "../../store/clock";
import { isHeard } from "../../store/link-loss";
import { commandVehicle } from "../../store/notices";
import { hasRole } from "../../store/principal";
import { hasRunEnded } from "../../store/runs";
import { panel, selectedRun, selectRun, showView, view } from "../../store/selection";
import { dispatch, live, runs, world } from "../../store/store";
import { HoldButton } from "../../ui/buttons";
import { Icon } from "../../ui/icons";
import { LinkLostAtDrop } from "./link-lost";

/**
 * A drop that asks: which vehicle, what was checked, how long; the release is held to confirm, the refusal is one
 * press.
 */
export function ConsentCard({ question: { run, drop, consent }, first }: { question: ConsentRequest; first: boolean }) {
  const [busy, setBusy] = useState(false);
  const left_s = secondsLeft(consent, serviceNow(world.value.serviceAhead_s));
  const whole_s =
    consent.deadline_at === null || consent.asked_at === null ? null : consent.deadline_at - consent.asked_at;
  const heard = useComputed(() => isHeard(run.vehicle_id)).value;
  const disabled = busy || !live.value || left_s === 0 || !hasRole("pilot");
  const answer = async (grant: boolean) => {
    setBusy(true);
    const action = `${grant ? "Consent to" : "Refuse"} ${drop.plan_item_id} of ${run.vehicle_id}`;
    await commandVehicle(action, run.vehicle_id, async () =>
      dispatch({ type: "run_read", run: await api.answerConsent(run.id, drop.plan_item_id, grant, consent.question) }),
    );
    setBusy(false);
  };
  return (
    <section class="consent-card tone-drop" aria-label={`${run.vehicle_id} asks for consent to ${drop.plan_item_id}`}>
      <header>
        <h4>
          {heard ? `${run.vehicle_id} holds` : `${run.vehicle_id}, when it was heard last, held`} at “
          {drop.plan_item_id}”. Release the parcel?
        </h4>
        <b class="countdown" role="timer">
          {left_s === null ? "" : `${Math.ceil(left_s)} s`}
        </b>
      </header>
      {left_s !== null && whole_s !== null && (
        <progress max={whole_s} value={left_s} aria-label="Time left to answer" />
      )}
      <LinkLostAtDrop vehicle={run.vehicle_id} />
      <p class="consent-checks">{checksOf(consent)}</p>
      <div class="actions">
        <HoldButton
          verb={`Release ${drop.plan_item_id} from`}
          vehicle={run.vehicle_id}
          tone="ok"
          primary={first}
          disabled={disabled}
          onConfirm={() => void answer(true)}
        />
        <button type="button" class="refuse" disabled={disabled} onClick={() => void answer(false)}>
          Keep on board
        </button>
      </div>
      <small>
        {hasRole("pilot")
          ? "Without an answer in time, the parcel stays on board. Waydrop repeats all checks before the release."
          : "Only a pilot can answer. Without an answer in time, the parcel stays on board."}
      </small>
    </section>
  );
}

/** What was measured when it was asked. */
function checksOf({ checked, question }: ConsentRequest["consent"]): string {
  const parts = [
    question > 1 ? `request ${question}` : "",
    checked == null ? "" : `${formatDistance(checked.offset_m)} from the point`,
    checked == null ? "" : `${formatAltitude(checked.relative_altitude_m)} high`,
    checked == null ? "" : `at ${formatSpeed(checked.ground_speed_m_s)}`,
    checked == null ? "" : `battery ${formatPercent(checked.battery_percent)}`,
  ];
  return parts.filter((part) => part !== "").join(" · ");
}

/** Alerts for requests that are not on the screen: of other runs, or behind another panel. */
export function ConsentAlerts() {
  const shown = panel.value === "run" ? selectedRun.value?.id : undefined;
  const narrow = view.value !== "run" && matchMedia("(max-width: 1099px)").matches;
  const calls = allConsentRequests(runs.value).filter(({ run }) => run.id !== shown || narrow);
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
                “{drop.plan_item_id}”{!isHeard(run.vehicle_id) && ", link lost"}
                <span aria-hidden="true">{left_s === null ? "" : `, ${Math.ceil(left_s)} s left`}</span>
              </p>
            </div>
            <button type="button" class="small" aria-label={`Show the request of ${run.vehicle_id}`} onClick={show}>
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
interface ConsentRequest {
  readonly run: Run;
  readonly drop: DropRecord;
  readonly consent: ConsentRecord;
}

/** Of one run, in the order of its drops. */
export function consentRequests(run: Run): ConsentRequest[] {
  if (hasRunEnded(run)) return [];
  return run.drops.flatMap((drop) => (drop.consent?.state === "asked" ? [{ run, drop, consent: drop.consent }] : []));
}

/** Of all runs, the most urgent first. */
export function allConsentRequests(runs: Readonly<Record<string, Run>>): ConsentRequest[] {
  const all = Object.values(runs).flatMap(consentRequests);
  return all.sort((a, b) => (a.consent.deadline_at ?? Infinity) - (b.consent.deadline_at ?? Infinity));
}

/** Seconds that are left to answer, by the service's clock; null if one of the two is not known. */
export function secondsLeft(consent: ConsentRecord, serviceNow_s: number | null): number | null {
  return consent.deadline_at === null || serviceNow_s === null ? null : Math.max(0, consent.deadline_at - serviceNow_s);
}
