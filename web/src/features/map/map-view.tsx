import { useEffect, useRef, useState } from "preact/hooks";
import { formatDistance, roundDistance } from "../../format/units";
import { metresBetween, vehiclePoint } from "../../geo/geometry";
import { following, mapExtent } from "../../store/map-view";
import { vehicles } from "../../store/store";
import { GoToHint, useGoToKeys } from "../offboard/go-to";
import { useEditorKeys } from "../plan/map-editor";
import { MapToolbar } from "../plan/map-toolbar";
import { TaskHint, useTaskKeys } from "../tasks/task-form";
import { BasemapCaption, BasemapOffer, BasemapTools } from "./basemap-choice";
import { bindScene } from "./binding";
import { boundsAround, planPoints } from "./camera";
import type { GridLabel } from "./graticule";
import { MapTool } from "./map-tool";
import { Finder, MeasureHint, useZonesDrop, ZonesPanel } from "./map-tool-panels";
import { finderOpen, measure, measuring, openFinder, useMapToolKeys, zonesOpen } from "./map-tools";
import type { MapScene } from "./scene";
import { followable, mapToolActive, shownPlan } from "./shown";

export function MapView() {
  const container = useRef<HTMLDivElement>(null);
  const vehicleCanvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<MapScene | null>(null);
  const [labels, setLabels] = useState<readonly GridLabel[]>([]);
  useEditorKeys();
  useGoToKeys();
  useTaskKeys();
  useMapToolKeys();
  useZonesDrop(container);
  useEffect(() => {
    if (container.current === null || vehicleCanvas.current === null) return undefined;
    const bound = bindScene(container.current, vehicleCanvas.current, setLabels);
    scene.current = bound.scene;
    return bound.dispose;
  }, []);
  return (
    <section class={`map${mapToolActive.value ? " drawing" : ""}`} aria-label="Map">
      <div class="map-canvas" ref={container} />
      {/* biome-ignore lint/a11y/noAriaHiddenOnFocusable: a canvas without tabindex has no focus */}
      <canvas class="map-vehicles" aria-hidden="true" ref={vehicleCanvas} />
      <GridLabels labels={labels} />
      <span class="map-cross" aria-hidden="true" />
      <MapToolbar />
      <GoToHint />
      <MeasureHint />
      <TaskHint />
      <MapScale />
      <BasemapCaption />
      <BasemapOffer />
      <Finder />
      <ZonesPanel />
      <MapTools scene={() => scene.current} />
    </section>
  );
}

function GridLabels({ labels }: { labels: readonly GridLabel[] }) {
  return (
    <div class="grid-labels" aria-hidden="true">
      {labels.map(({ edge, at_px, text }) => (
        <span
          key={edge + text}
          class={`edge-${edge}`}
          style={edge === "top" ? { left: `${at_px}px` } : { top: `${at_px}px` }}
        >
          {text}
        </span>
      ))}
    </div>
  );
}

function MapTools({ scene }: { scene: () => MapScene | null }) {
  const showAll = () => {
    following.value = false;
    const points = Object.values(vehicles.value)
      .map(vehiclePoint)
      .filter((at) => at !== null);
    const plan = shownPlan.value;
    const bounds = boundsAround([...points, ...(plan === null ? [] : planPoints(plan.view))]);
    if (bounds !== null) scene()?.fit(bounds);
  };
  return (
    <div class="map-tools">
      <MapTool icon="plus" label="Zoom in" onClick={() => scene()?.zoomBy(1)} />
      <MapTool icon="minus" label="Zoom out" onClick={() => scene()?.zoomBy(-1)} />
      <MapTool icon="fit" label="Show all" onClick={showAll} />
      {followable.value && (
        <MapTool
          icon="follow"
          label={`Follow ${followable.value.id}`}
          pressed={following.value}
          onClick={() => (following.value = !following.value)}
        />
      )}
      <MapTool
        icon="ruler"
        label="Measure distance and bearing (M)"
        pressed={measuring.value}
        onClick={() => measure(!measuring.value)}
      />
      <MapTool
        icon="search"
        label="Find a place (/)"
        pressed={finderOpen.value}
        onClick={() => openFinder(!finderOpen.value)}
      />
      <MapTool
        icon="layers"
        label="Zones"
        pressed={zonesOpen.value}
        onClick={() => (zonesOpen.value = !zonesOpen.value)}
      />
      <BasemapTools />
    </div>
  );
}

const WIDEST_PX = 120;
/** The steps of round distances are at most so far apart. */
const STEP = 2.5;

/** How long a round distance is on the screen, in the middle of the map. */
function MapScale() {
  const view = mapExtent.value;
  if (view === null || view.width_px === 0) return null;
  const middle = (view.south + view.north) / 2;
  const metresPerPixel = metresBetween([view.west, middle], [view.east, middle]) / view.width_px;
  if (!(metresPerPixel > 0) || view.east - view.west > 180) return null;
  const length_m = roundDistance((WIDEST_PX / STEP) * metresPerPixel);
  return (
    <span class="map-scale" style={{ width: `${(length_m / metresPerPixel).toFixed(0)}px` }} aria-hidden="true">
      {formatDistance(length_m)}
    </span>
  );
}
