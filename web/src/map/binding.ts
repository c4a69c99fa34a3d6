/** Ties the scene to the signals: each source is drawn anew when, and only when, what it shows has changed. */

import { computed, effect, signal, untracked } from "@preact/signals";
import { roundDistance, systemName } from "../format/units";
import { viewPlan, type PlanView } from "../plan/document";
import type { Run, Timeline } from "../api/types";
import { draftTimeline } from "../state/draft";
import { draftNumber, draftView } from "../state/draft-text";
import { applyTool, dragTo, finishSketch, handles, letGo, sketch, takeHandle } from "../state/editor";
import { goTo } from "../state/controls";
import { controlledVehicle } from "../state/hands-on";
import { goThere } from "../state/hands-session";
import { mapToolInHand } from "../state/map-tool";
import { runPlan } from "../state/run-plan";
import { itemId, panel, selectedRun, selectedVehicle, selectVehicle, vehicleId } from "../state/selection";
import { serviceNow } from "../state/clock";
import { slowed } from "../state/slowed";
import { live, tracks, vehicles, world } from "../state/store";
import { mapTargets } from "../state/targets";
import { draftTask, placeTask, taskPlaces } from "../state/task-draft";
import { taskQueue } from "../state/task-queue";
import { theme } from "../state/theme";
import { tiles } from "../state/tiles";
import { boundsAround, following, homeOf, planPoints, vehiclePoint, viewed } from "./camera";
import { destinationFeatures, dropFeatures, fenceFeatures, handleFeatures, itemProgress, pathFeatures, placeFeatures, ringFeatures, sketchFeatures, trackFeatures, collection } from "./features";
import { metresBetween } from "./geometry";
import { graticule, type View } from "./graticule";
import { gridLabels, type Label } from "./grid-labels";
import { releaseFeatures } from "./release";
import { PALETTES } from "./palette";
import { Scene } from "./scene";
import { targetFeatures } from "./target-features";
import { taskFeatures } from "./task-features";
import type { Look } from "./look";
import { vehicleMarks } from "./vehicle-marks";

/** The plan on the map: the draft while it is being prepared, else the chosen run's. */
export const shownPlan = computed<{ readonly key: string; readonly view: PlanView; readonly run: Run | null; readonly timeline: Timeline | null } | null>(() => {
  const draft = draftView.value;
  if (panel.value === "plan" && draft !== null) return { key: `draft ${draftNumber.value}`, view: draft, run: null, timeline: draftTimeline.value };
  const run = selectedRun.value;
  const view = runPlanView.value;
  return run === null || view === null ? null : { key: run.id, view, run, timeline: runPlan.value?.timeline ?? null };
});

/** Read once: telemetry and the run's progress do not change it. */
const runPlanView = computed(() => (runPlan.value === null ? null : viewPlan(runPlan.value.plan)));

const home = computed(() => homeOf(selectedVehicle.value ?? Object.values(vehicles.value)[0] ?? null, shownPlan.value?.view ?? null));
/** As text: telemetry brings the same place again and again, and nothing is drawn anew for that. */
const homeKey = computed(() => JSON.stringify(home.value));

/** Tails are long and change slowly: drawn with each telemetry frame they would cost more than all the rest. */
const TAILS_MS = 500;
const tails = slowed(tracks, TAILS_MS);

const textSize_px = signal(rootTextSize());
const look = computed<Look>(() => ({ palette: PALETTES[theme.value], theme: theme.value, tiles, scale: Math.max(1, textSize_px.value / 15.5) }));

function rootTextSize(): number {
  return Number.parseFloat(getComputedStyle(document.documentElement).fontSize);
}

export function bindScene(container: HTMLElement, above: HTMLCanvasElement, onLabels: (labels: readonly Label[]) => void): { scene: Scene; dispose: () => void } {
  const grid = new Grid(onLabels);
  const scene = new Scene(container, above, look.peek(), {
    onView: (view) => {
      viewed.value = view;
      grid.show(scene, view);
    },
    onVehicle: (id) => !mapToolInHand.peek() && selectVehicle(id),
    onPlace: (id) => !mapToolInHand.peek() && (itemId.value = id),
    onGrab: () => (following.value = false),
    onMap: (at) => goThere(at) || placeTask(at) || applyTool(at),
    onDoubleClick: finishSketch,
    onGrip: takeHandle,
    onDrag: dragTo,
    onLetGo: letGo,
  });
  const effects = [
    effect(() => scene.setLook(look.value)),
    effect(() => scene.setVehicles(vehicleMarks(vehicles.value, vehicleId.value, live.value))),
    effect(() => scene.setData("tracks", trackFeatures(tails.value))),
    effect(() => drawPlan(scene)),
    effect(() => scene.setData("handles", handleFeatures(handles.value))),
    effect(() => scene.setData("sketch", sketchFeatures(sketch.value))),
    effect(() => scene.setDrawing(mapToolInHand.value)),
    effect(() => scene.setData("tasks", taskFeatures(taskQueue.value, draftTask.value, taskPlaces.value))),
    effect(() => scene.setData("targets", targetFeatures(mapTargets.value, mapTargets.value === null ? null : serviceNow(world.value.serviceAhead_s)))),
    effect(() => scene.setData("destination", destinationFeatures(goTo.value?.at ?? null, goTo.value === null ? null : vehiclePoint(controlledVehicle.value)))),
    effect(() => {
      void homeKey.value;
      void systemName.value; // rings are at round distances of the chosen unit
      grid.home(scene);
    }),
    effect(() => follow(scene)),
    effect(() => lookAtItem(scene)),
    lookAtNews(scene),
  ];
  const onResize = () => (textSize_px.value = rootTextSize());
  window.addEventListener("resize", onResize);
  return {
    scene,
    dispose: () => {
      window.removeEventListener("resize", onResize);
      for (const end of effects) end();
      scene.destroy();
    },
  };
}

function drawPlan(scene: Scene): void {
  const plan = shownPlan.value;
  const nothing = collection([]);
  if (plan === null) {
    for (const source of ["path", "places", "drops", "fences", "release"] as const) scene.setData(source, nothing);
    return;
  }
  void homeKey.value;
  const start = home.peek() ?? plan.view.home;
  const progress = itemProgress(plan.view, plan.run);
  scene.setData("path", pathFeatures(plan.view, start, progress));
  scene.setData("places", placeFeatures(plan.view, progress, itemId.value));
  scene.setData("drops", dropFeatures(plan.view, plan.run));
  scene.setData("fences", fenceFeatures(plan.view));
  scene.setData("release", releaseFeatures(plan.view, plan.timeline));
}

function follow(scene: Scene): void {
  const at = vehiclePoint(selectedVehicle.value);
  if (following.value && at !== null) scene.centre(at);
}

function lookAtItem(scene: Scene): void {
  const id = itemId.value;
  const at = untracked(() => shownPlan.value?.view.items.find((item) => item.id === id)?.at);
  if (at && !scene.shows(at)) scene.centre(at, 16);
}

/** Show the fleet once it is known, and each other plan once: then the map is the operator's. */
function lookAtNews(scene: Scene): () => void {
  const seen = new Set<string>();
  return effect(() => {
    const plan = shownPlan.value;
    const points = Object.values(vehicles.value).map(vehiclePoint).filter((at) => at !== null);
    const key = plan?.key ?? (points.length > 0 ? "fleet" : null);
    if (key === null || seen.has(key)) return;
    seen.add(key);
    const bounds = boundsAround(plan === null ? points : planPoints(plan.view));
    if (bounds !== null && !following.peek()) scene.fit(bounds);
  });
}

/** So many steps make the height of the view: three rings fill about its shorter half. */
const RINGS = 8;

/** Graticule and range rings: they depend on the view and on home alone. */
class Grid {
  #view: View | null = null;
  #covered: View | null = null;

  constructor(private readonly onLabels: (labels: readonly Label[]) => void) {}

  show(scene: Scene, view: View): void {
    this.#view = view;
    const grid = graticule(view);
    this.onLabels(gridLabels(grid, view, (at) => scene.project(at)));
    if (this.#covered !== null && covers(this.#covered, view)) return;
    this.#covered = view;
    scene.setData("gridMinor", collection([{ type: "Feature", properties: {}, geometry: { type: "MultiLineString", coordinates: grid.minor } }]));
    scene.setData("gridMajor", collection([{ type: "Feature", properties: {}, geometry: { type: "MultiLineString", coordinates: grid.major } }]));
    this.home(scene);
  }

  home(scene: Scene): void {
    const view = this.#view;
    if (view === null) return;
    const height_m = metresBetween([view.west, view.south], [view.west, view.north]);
    scene.setData("rings", ringFeatures(home.peek(), roundDistance(height_m / RINGS)));
  }
}

/** Whether the lines drawn for one view still serve another: near enough in place and scale. */
function covers(drawn: View, view: View): boolean {
  const scale = (view.east - view.west) / (drawn.east - drawn.west);
  const marginLon = (drawn.east - drawn.west) / 2;
  const marginLat = (drawn.north - drawn.south) / 2;
  return (
    Math.abs(scale - 1) < 0.02 &&
    view.west > drawn.west - marginLon &&
    view.east < drawn.east + marginLon &&
    view.south > drawn.south - marginLat &&
    view.north < drawn.north + marginLat
  );
}
