/** The steps of a first flight, by what the user has done so far. Pure. */

import type { Run } from "../../api/types";
import { hasRunEnded } from "../../store/runs";
import type { View } from "../../store/selection";

export interface Progress {
  /** The simulated multicopter that is chosen. */
  readonly vehicle: string | null;
  /** Whether a plan for a multicopter is open. */
  readonly hasPlan: boolean;
  /** The run that was made on this tour. One that ended before its start was no flight. */
  readonly run: Pick<Run, "state" | "started_at"> | null;
}

export interface Step {
  readonly title: string;
  readonly text: string;
  /** What the step's button does, and the view in which it is done. */
  readonly act: { readonly label: string; readonly does: "select" | "open" | "show"; readonly view: View };
}

export const STEPS = 5;

/** 0 to 4; `STEPS` once the flight has ended. */
export function stepOf({ vehicle, hasPlan, run }: Progress): number {
  if (run !== null && run.started_at !== null) return hasRunEnded(run) ? STEPS : 4;
  if (run !== null && !hasRunEnded(run)) return 3;
  return vehicle === null ? 0 : hasPlan ? 2 : 1;
}

/** `vehicle`: the one that is chosen, else the one to choose. */
export function describeStep(step: number, vehicle: string): Step {
  switch (step) {
    case 0:
      return {
        title: "Select a vehicle",
        text: `${vehicle} is a simulated multicopter: nothing real flies.`,
        act: { label: `Select ${vehicle}`, does: "select", view: "fleet" },
      };
    case 1:
      return {
        title: "Open a plan",
        text: "A plan says where to fly and where to drop. The example drops a parcel 80 m away.",
        act: { label: "Open example plan", does: "open", view: "plan" },
      };
    case 2:
      return {
        title: "Upload the plan",
        text: `Waydrop has checked it: “Can be flown”. Press “Upload to ${vehicle}”.`,
        act: { label: "Show plan", does: "show", view: "plan" },
      };
    case 3:
      return {
        title: "Start the flight",
        text: `Hold “Start ${vehicle}” for a second, so that no flight starts by accident.`,
        act: { label: "Show run", does: "show", view: "run" },
      };
    case 4:
      return {
        title: "Watch the drop",
        text: `${vehicle} stops at the point and releases the parcel. The run shows the outcome with its evidence.`,
        act: { label: "Show map", does: "show", view: "map" },
      };
    default:
      return {
        title: "The flight has ended",
        text: "The run keeps the outcome of each drop. Save the delivery report there, or open a plan of your own.",
        act: { label: "Show run", does: "show", view: "run" },
      };
  }
}
