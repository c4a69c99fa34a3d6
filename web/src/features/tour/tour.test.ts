import { afterEach, expect, test } from "vitest";
import type { Run } from "../../api/types";
import { selectVehicle, view } from "../../store/selection";
import { world } from "../../store/store";
import { EMPTY_WORLD } from "../../store/world";
import { sampleRun, sampleVehicle } from "../../testing/samples";
import { uploadedRun } from "../plan/draft";
import { simulator } from "../simulator/simulator";
import { act, endTour, startTour, tourStep } from "./tour";

const SIMULATED = { system_id: 1 } as NonNullable<typeof simulator.value>["vehicles"][number];

function fly(...runs: Run[]): void {
  world.value = {
    ...EMPTY_WORLD,
    vehicles: { v1: sampleVehicle() },
    runs: Object.fromEntries(runs.map((run) => [run.id, run])),
  };
}

function shown(): [number | null, string] | null {
  const step = tourStep.value;
  return step === null ? null : [step.number, step.title];
}

afterEach(endTour);

test("after the upload the tour leads to the start, to the drop and to the run's outcome", () => {
  const before = sampleRun({ id: "before", state: "completed", started_at: 1, created_at: 1 });
  const run = (state: Run["state"], started_at: number | null) =>
    sampleRun({ id: "tour", state, started_at, created_at: 2 });
  simulator.value = { configured: true, available: true, reason: null, faults: [], speed: null, vehicles: [SIMULATED] };
  fly(before);
  selectVehicle("v1");
  startTour();
  expect(shown()).toEqual([2, "Open a plan"]);
  const foreign = sampleRun({ id: "foreign", state: "aborted", created_at: 3 });
  fly(before, foreign);
  expect(shown()).toEqual([2, "Open a plan"]);
  uploadedRun.value = "tour";
  fly(before, run("uploaded", null), foreign);
  expect(shown()).toEqual([4, "Start the flight"]);
  fly(before, run("flying", 3));
  expect(shown()).toEqual([5, "Watch the drop"]);
  fly(before, run("at_drop", 3));
  const last = tourStep.value;
  expect(last?.number).toBe(5);
  if (last !== null) act(last);
  expect(view.value).toBe("map");
  fly(before, run("completed", 3));
  expect(shown()).toEqual([null, "The flight has ended"]);
});
