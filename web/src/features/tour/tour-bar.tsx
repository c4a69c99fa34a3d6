import { Icon } from "../../ui/icons";
import { STEPS } from "./steps";
import { act, canTour, endTour, startTour, tourStep } from "./tour";

/** Below the header, so that it covers nothing that it speaks of. */
export function TourBar() {
  const step = tourStep.value;
  if (step === null) return null;
  return (
    <aside class="tour" aria-label="Tour">
      <p role="status">
        <small>{step.number === null ? "Tour complete" : `Step ${step.number} of ${STEPS}`}</small>
        <b>{step.title}</b>
        <span>{step.text}</span>
      </p>
      <button type="button" class="small" onClick={() => act(step)}>
        {step.act.label}
      </button>
      <button type="button" class="icon-button" aria-label="End tour" title="End tour" onClick={endTour}>
        <Icon name="close" size={16} />
      </button>
    </aside>
  );
}

/** Wherever somebody looks for help; only where vehicles are simulated. In a dialog's form it closes the dialog. */
export function TourOffer() {
  if (!canTour.value) return null;
  return (
    <button type="submit" class="small" onClick={startTour}>
      Take a tour: a first delivery in {STEPS} steps
    </button>
  );
}
