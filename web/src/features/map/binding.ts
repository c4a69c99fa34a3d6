/** Ties the scene to the signals: each source is drawn anew when, and only when, what it shows has changed. */

import { computed, effect, signal, untracked } from "@preact/signals";
import { roundDistance, systemName } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { serviceNow } from "../../store/clock";
import { slowed } from "../../store/frame-pacing";
import type { MapExtent } from "../../store/map-view";
import { following, viewed } from "../../store/map-view";
import { theme } from "../../store/preferences";
import { itemId, selectedVehicle, selectVehicle, vehicleId } from "../../store/selection";
import { live, tracks, vehicles, world } from "../../store/store";
import { goThere } from "../offboard/control-session";
import { controlledVehicle, goTo } from "../offboard/control-state";
import { applyTool, dragTo, finishSketch, handles, letGo, sketch, takeHandle } from "../plan/map-editor";
import { itemProgress } from "../plan/progress";
import { taskQueue } from "../tasks/queue";
import { draftTask, placeTask, taskPlaces } from "../tasks/task-draft";
import { boundsAround, planPoints } from "./camera";
import { graticule, gridLabels, type Label } from "./graticule";
import { type Look, PALETTES } from "./look";
import {
  collection,
  destinationFeatures,
  dropFeatures,
  fenceFeatures,
  handleFeatures,
  pathFeatures,
  placeFeatures,
  releaseFeatures,
  ringFeatures,
  sketchFeatures,
  trackFeatures,
} from "./plan-features";
import { Scene } from "./scene";
import { home, homeKey, mapTargets, mapToolInHand, shownPlan, tiles } from "./shown";
import { targetFeatures } from "./target-layers";
import { taskFeatures } from "./task-layers";
import { vehicleMarks } from "./vehicle-marks";

/** Tails are long and change slowly: drawn with each telemetry frame they would cost more than all the rest. */
const TAILS_MS = 500;
const tails = slowed(tracks, TAILS_MS);

const textSize_px = signal(rootTextSize());
const look = computed<Look>(() => ({
  palette: PALETTES[theme.value],
  theme: theme.value,
  tiles,
  scale: Math.max(1, textSize_px.value / 15.5),
}));

function rootTextSize(): number {
  return Number.parseFloat(getComputedStyle(document.documentElement).fontSize);
}

export function bindScene(
  container: HTMLElement,
  above: HTMLCanvasElement,
  onLabels: (labels: readonly Label[]) => void,
): { scene: Scene; dispose: () => void } {
  const grid = new Grid(onLabels);
  const scene = new Scene(container, above, look.peek(), {
    onView: (view) => {
      viewed.value = view;
      grid.show(scene, view);
    },
    onVehicle: (id) => !mapToolInHand.peek() && selectVehicle(id),
    onPlace: (id) => {
      if (!mapToolInHand.peek()) itemId.value = id;
    },
    onGrab: () => (following.value = false),
    onMap: (at) => goThere(at) || placeTask(at) || applyTool(at),
    onDoubleClick: finishSketch,
    onGrip: takeHandle,
    onDrag: dragTo,
    onLetGo: letGo,
  });
  const effects = draw(scene, grid);
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

/** Each draws its source when what it shows has changed. Returns how to end each. */
function draw(scene: Scene, grid: Grid): (() => void)[] {
  return [
    effect(() => scene.setLook(look.value)),
    effect(() => scene.setVehicles(vehicleMarks(vehicles.value, vehicleId.value, live.value))),
    effect(() => scene.setData("tracks", trackFeatures(tails.value))),
    effect(() => drawPlan(scene)),
    effect(() => scene.setData("handles", handleFeatures(handles.value))),
    effect(() => scene.setData("sketch", sketchFeatures(sketch.value))),
    effect(() => scene.setDrawing(mapToolInHand.value)),
    effect(() => scene.setData("tasks", taskFeatures(taskQueue.value, draftTask.value, taskPlaces.value))),
    effect(() =>
      scene.setData(
        "targets",
        targetFeatures(mapTargets.value, mapTargets.value === null ? null : serviceNow(world.value.serviceAhead_s)),
      ),
    ),
    effect(() =>
      scene.setData(
        "destination",
        destinationFeatures(goTo.value?.at ?? null, goTo.value === null ? null : vehiclePoint(controlledVehicle.value)),
      ),
    ),
    effect(() => {
      void homeKey.value;
      void systemName.value; // rings are at round distances of the chosen unit
      grid.home(scene);
    }),
    effect(() => follow(scene)),
    effect(() => lookAtItem(scene)),
    lookAtNews(scene),
  ];
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
    const points = Object.values(vehicles.value)
      .map(vehiclePoint)
      .filter((at) => at !== null);
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
  #view: MapExtent | null = null;
  #covered: MapExtent | null = null;

  constructor(private readonly onLabels: (labels: readonly Label[]) => void) {}

  show(scene: Scene, view: MapExtent): void {
    this.#view = view;
    const grid = graticule(view);
    this.onLabels(gridLabels(grid, view, (at) => scene.project(at)));
    if (this.#covered !== null && covers(this.#covered, view)) return;
    this.#covered = view;
    scene.setData(
      "gridMinor",
      collection([{ type: "Feature", properties: {}, geometry: { type: "MultiLineString", coordinates: grid.minor } }]),
    );
    scene.setData(
      "gridMajor",
      collection([{ type: "Feature", properties: {}, geometry: { type: "MultiLineString", coordinates: grid.major } }]),
    );
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
function covers(drawn: MapExtent, view: MapExtent): boolean {
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
