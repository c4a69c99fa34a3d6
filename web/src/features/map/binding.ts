/** Ties the scene to the signals: each source is drawn anew when, and only when, what it shows has changed. */

import { computed, effect, signal, untracked } from "@preact/signals";
import type { RunState } from "../../api/types";
import { roundDistance, unitSystem } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { serviceNow } from "../../store/clock";
import { throttled } from "../../store/frame-pacing";
import type { MapExtent } from "../../store/map-view";
import { country, following, mapExtent } from "../../store/map-view";
import { theme } from "../../store/preferences";
import { itemId, selectVehicle, vehicleId } from "../../store/selection";
import { live, runs, tracks, vehicles, world } from "../../store/store";
import { trackLines } from "../../store/tracks";
import { goToPoint } from "../offboard/control-session";
import { controlledVehicle, goToTarget } from "../offboard/control-state";
import { applyTool, dragTo, endDrag, finishSketch, handles, sketch, startDrag } from "../plan/map-editor";
import { itemProgress } from "../plan/progress";
import { taskQueue } from "../tasks/queue";
import { addTaskPoint, draftTask, taskPoints } from "../tasks/task-draft";
import { boundsAround, planPoints } from "./camera";
import { basemapFailed, basemapLayers, watchBasemap } from "./chosen-basemap";
import { type GridLabel, graticule, gridLabels } from "./graticule";
import { type MapLook, PALETTES } from "./look";
import { found, measured, measurePoint, newZones, zones } from "./map-tools";
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
} from "./plan-features";
import { MapScene } from "./scene";
import { followable, mapTargets, mapToolActive, shownHome, shownHomeKey, shownPlan } from "./shown";
import { targetFeatures } from "./target-layers";
import { taskFeatures } from "./task-layers";
import { toolFeatures, zoneFeatures } from "./tool-layers";
import { vehicleMarks } from "./vehicle-marks";
import { zoneBounds } from "./zones";

/** Tails are long and change slowly: drawn with each telemetry frame they would cost more than all the rest. */
const TAILS_MS = 500;
const FOUND_ZOOM = 16;
const tails = throttled(tracks, TAILS_MS);

const textSize_px = signal(rootTextSize());
const look = computed<MapLook>(() => ({
  palette: PALETTES[theme.value],
  theme: theme.value,
  basemapLayers: basemapLayers.value,
  scale: Math.max(1, textSize_px.value / 15.5),
}));

function rootTextSize(): number {
  return Number.parseFloat(getComputedStyle(document.documentElement).fontSize);
}

export function bindScene(
  container: HTMLElement,
  above: HTMLCanvasElement,
  onLabels: (labels: readonly GridLabel[]) => void,
): { scene: MapScene; dispose: () => void } {
  const grid = new Grid(onLabels);
  const scene = new MapScene(container, above, look.peek(), {
    onView: (view) => {
      mapExtent.value = view;
      grid.show(scene, view);
    },
    onVehicle: (id) => !mapToolActive.peek() && selectVehicle(id),
    onPlace: (id) => {
      if (!mapToolActive.peek()) itemId.value = id;
    },
    onGrab: () => (following.value = false),
    onMap: (at) => goToPoint(at) || addTaskPoint(at) || measurePoint(at) || applyTool(at),
    onDoubleClick: finishSketch,
    onBasemapError: basemapFailed,
    onCountry: (name) => (country.value = name),
    onGrip: startDrag,
    onDrag: dragTo,
    onLetGo: endDrag,
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
function draw(scene: MapScene, grid: Grid): (() => void)[] {
  return [
    effect(() => scene.setLook(look.value)),
    effect(() => scene.setVehicles(vehicleMarks(vehicles.value, vehicleId.value, live.value))),
    effect(() => scene.setTails(Object.values(tails.value).flatMap(trackLines))),
    effect(() => drawPlan(scene)),
    effect(() => scene.setData("handles", handleFeatures(handles.value))),
    effect(() => scene.setData("sketch", sketchFeatures(sketch.value))),
    effect(() => scene.setDrawing(mapToolActive.value)),
    effect(() => scene.setData("tasks", taskFeatures(taskQueue.value, draftTask.value, taskPoints.value))),
    effect(() =>
      scene.setData(
        "targets",
        targetFeatures(mapTargets.value, mapTargets.value === null ? null : serviceNow(world.value.serviceAhead_s)),
      ),
    ),
    effect(() =>
      scene.setData(
        "destination",
        destinationFeatures(
          goToTarget.value?.at ?? null,
          goToTarget.value === null ? null : vehiclePoint(controlledVehicle.value),
        ),
      ),
    ),
    effect(() => {
      void shownHomeKey.value;
      void unitSystem.value; // rings are at round distances of the chosen unit
      grid.home(scene);
    }),
    effect(() => follow(scene)),
    effect(() => lookAtItem(scene)),
    effect(() => scene.setData("tools", toolFeatures(measured.value, found.value))),
    effect(() => scene.setData("zones", zoneFeatures(zones.value))),
    effect(() => {
      const bounds = newZones.value === null ? null : zoneBounds(newZones.value);
      if (bounds !== null) scene.fit(bounds);
    }),
    effect(() => {
      if (found.value !== null) scene.centre(found.value, FOUND_ZOOM);
    }),
    lookAtNews(scene),
    lookAtStarts(scene),
    watchBasemap(),
  ];
}

function drawPlan(scene: MapScene): void {
  const plan = shownPlan.value;
  const nothing = collection([]);
  if (plan === null) {
    for (const source of ["path", "places", "drops", "fences", "release"] as const) scene.setData(source, nothing);
    return;
  }
  void shownHomeKey.value;
  const start = shownHome.peek() ?? plan.view.home;
  const progress = itemProgress(plan.view, plan.run);
  scene.setData("path", pathFeatures(plan.view, start, progress));
  scene.setData("places", placeFeatures(plan.view, progress, itemId.value));
  scene.setData("drops", dropFeatures(plan.view, plan.run));
  scene.setData("fences", fenceFeatures(plan.view));
  scene.setData("release", releaseFeatures(plan.view, plan.timeline));
}

function follow(scene: MapScene): void {
  const at = vehiclePoint(followable.value);
  if (following.value && at !== null) scene.centre(at);
}

function lookAtItem(scene: MapScene): void {
  const id = itemId.value;
  const at = untracked(() => shownPlan.value?.view.items.find((item) => item.id === id)?.at);
  if (at && !scene.shows(at)) scene.centre(at, 16);
}

/** Show the fleet once it is known, and each other plan once: then the map is the operator's. */
function lookAtNews(scene: MapScene): () => void {
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

const IN_FLIGHT: ReadonlySet<RunState> = new Set(["starting", "flying", "at_drop"]);

/** A flight that starts is brought into view, with all that fly; not while the map is used for something else. */
function lookAtStarts(scene: MapScene): () => void {
  let before: ReadonlySet<string> | null = null;
  return effect(() => {
    const flying = Object.values(runs.value).filter(({ state }) => IN_FLIGHT.has(state));
    const started = before !== null && flying.some(({ id }) => before?.has(id) === false);
    before = new Set(flying.map(({ id }) => id));
    if (!started || following.peek() || mapToolActive.peek()) return;
    const plan = shownPlan.peek();
    const places = flying
      .map(({ vehicle_id }) => vehiclePoint(vehicles.peek()[vehicle_id] ?? null))
      .filter((at) => at !== null);
    const bounds = boundsAround([...places, ...(plan === null ? [] : planPoints(plan.view))]);
    if (bounds !== null) scene.fit(bounds);
  });
}

/** So many steps make the height of the view: three rings fill about its shorter half. */
const RINGS = 8;

/** Graticule and range rings: they depend on the view and on home alone. */
class Grid {
  #view: MapExtent | null = null;
  #covered: MapExtent | null = null;

  constructor(private readonly onLabels: (labels: readonly GridLabel[]) => void) {}

  show(scene: MapScene, view: MapExtent): void {
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

  home(scene: MapScene): void {
    const view = this.#view;
    if (view === null) return;
    const height_m = metresBetween([view.west, view.south], [view.west, view.north]);
    scene.setData("rings", ringFeatures(shownHome.peek(), roundDistance(height_m / RINGS)));
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
