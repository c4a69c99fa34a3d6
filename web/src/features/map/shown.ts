/** What the map shows of the other features: a plan, home, moving targets; and whether its next click is for a tool. */

import { computed } from "@preact/signals";
import type { Run, Timeline } from "../../api/types";
import { secondsSince } from "../../store/clock";
import { panel, selectedRun, selectedVehicle, vehicleId } from "../../store/selection";
import { vehicleIds, vehicles } from "../../store/store";
import { goToArmed } from "../offboard/control-state";
import type { PlanView } from "../plan/document";
import { draftTimeline } from "../plan/draft";
import { draftGeneration, draftView } from "../plan/draft-text";
import { activeTool } from "../plan/map-editor";
import { runTargets } from "../run/moving-targets";
import { runPlan, runPlanView } from "../run/run-plan";
import { sightingIn, targetReports } from "../targets/reports";
import type { ShownTarget } from "../targets/targets";
import { taskKind, taskMayFollow } from "../tasks/task-draft";
import { homeOf } from "./camera";
import { measuring } from "./map-tools";

/** The plan on the map: the draft while it is being prepared, else the chosen run's. */
export const shownPlan = computed<{
  readonly key: string;
  readonly view: PlanView;
  readonly run: Run | null;
  readonly timeline: Timeline | null;
} | null>(() => {
  const draft = draftView.value;
  if (panel.value === "plan" && draft !== null)
    return { key: `draft ${draftGeneration.value}`, view: draft, run: null, timeline: draftTimeline.value };
  const run = selectedRun.value;
  const view = runPlanView.value;
  return run === null || view === null ? null : { key: run.id, view, run, timeline: runPlan.value?.timeline ?? null };
});

export const shownHome = computed(() =>
  homeOf(vehicles.value[vehicleId.value ?? vehicleIds.value[0] ?? ""] ?? null, shownPlan.value?.view ?? null),
);
/** As text: telemetry brings the same place again and again, and nothing is drawn anew for that. */
export const shownHomeKey = computed(() => JSON.stringify(shownHome.value));

/** Moving targets: those of the chosen run, and those that a task may follow. */
export const mapTargets = computed<readonly ShownTarget[] | null>(() => {
  const ofRun = panel.value === "plan" ? null : runTargets.value;
  const read = targetReports.value;
  if (!taskMayFollow.value || read === null) return ofRun;
  const after_s = secondsSince(read.at);
  const others = Object.keys(read.targets).filter((name) => ofRun?.every((one) => one.feed !== name) ?? true);
  return [
    ...(ofRun ?? []),
    ...others.map((name) => ({ ...sightingIn(read, name, after_s), follower: null, feed: name, word: null })),
  ];
});

/** The next click on the map is for a tool: it then chooses nothing. */
export const mapToolActive = computed(
  () => measuring.value || activeTool.value !== null || goToArmed.value || taskKind.value !== null,
);

/** What can be followed: the chosen vehicle, else the one that flies the run that is shown. */
export const followable = computed(
  () => selectedVehicle.value ?? vehicles.value[selectedRun.value?.vehicle_id ?? ""] ?? null,
);
