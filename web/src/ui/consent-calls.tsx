import { openQuestions, secondsLeft } from "../state/consents";
import { serviceNow } from "../state/clock";
import { panel, selectRun, selectedRun, showView, view } from "../state/selection";
import { runs, world } from "../state/store";
import { Icon } from "./icons";

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
                “{drop.plan_item_id}”<span aria-hidden="true">{left_s === null ? "" : `, ${Math.ceil(left_s)} s left`}</span>
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
