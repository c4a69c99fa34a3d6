/** A tour of a first flight with a simulated vehicle: it watches what the user does, and goes on by itself. */

import { computed, signal } from "@preact/signals";
import { selectedVehicle, selectVehicle, showView } from "../../store/selection";
import { runs, vehicles } from "../../store/store";
import { uploadedRun } from "../plan/draft";
import { draftView, openDraft, planText } from "../plan/draft-text";
import { simulator } from "../simulator/simulator";
import { examplePlan } from "./example-plan";
import { describeStep, STEPS, type Step, stepOf } from "./steps";

/** The run that this page had made before; null while there is no tour. */
const before = signal<{ readonly run: string | null } | null>(null);

/** The run that was made on the tour: other clients make runs too. */
const ownRun = computed(() => {
  const made = uploadedRun.value;
  return made === null || made === before.value?.run ? null : (runs.value[made] ?? null);
});

/** Simulated multicopters: the example is for one of them. */
const suitable = computed(() => {
  const simulated = new Set((simulator.value?.vehicles ?? []).map(({ system_id }) => system_id));
  return Object.values(vehicles.value)
    .filter((vehicle) => vehicle.vehicle_type === "multicopter" && simulated.has(vehicle.system_id))
    .map(({ id }) => id);
});

export const canTour = computed(() => suitable.value.length > 0);

export function startTour(): void {
  before.value = { run: uploadedRun.peek() };
}

export function endTour(): void {
  before.value = null;
}

interface TourStep extends Step {
  /** 1 to 5; null after the last one. */
  readonly number: number | null;
  readonly vehicle: string;
}

export const tourStep = computed<TourStep | null>(() => {
  if (before.value === null) return null;
  const run = ownRun.value;
  const chosen = suitable.value.find((id) => id === selectedVehicle.value?.id) ?? null;
  const step = stepOf({ vehicle: chosen, hasPlan: draftView.value?.vehicleType === "multicopter", run });
  const vehicle = run?.vehicle_id ?? chosen ?? suitable.value[0];
  if (vehicle === undefined) return null;
  return { ...describeStep(step, vehicle), number: step < STEPS ? step + 1 : null, vehicle };
});

export function act({ act: { does, view }, vehicle }: TourStep): void {
  const home = vehicles.peek()[vehicle]?.state.home ?? null;
  if (does === "select") selectVehicle(vehicle);
  else if (does === "open" && home !== null) openDraft(planText(examplePlan(home)));
  showView(view);
}
