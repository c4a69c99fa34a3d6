import { useEffect, useRef, useState } from "preact/hooks";
import { boundsAround, following, vehiclePoint } from "../map/camera";
import { bindScene, shownPlan } from "../map/binding";
import type { Scene } from "../map/scene";
import type { Label } from "../map/grid-labels";
import { planPoints } from "../map/camera";
import { selectedVehicle } from "../state/selection";
import { vehicles } from "../state/store";
import { mapToolInHand } from "../state/map-tool";
import { MapScale } from "./map-scale";
import { MapToolbar } from "./map-toolbar";
import { useEditorKeys } from "./use-editor-keys";
import { useGoToKeys } from "./use-go-to-keys";
import { useTaskKeys } from "./use-task-keys";
import { GoToHint } from "./go-to-hint";
import { TaskHint } from "./task-hint";
import { tiles } from "../state/tiles";
import { Icon, type IconName } from "./icons";

export function MapView() {
  const container = useRef<HTMLDivElement>(null);
  const vehicleCanvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<Scene | null>(null);
  const [labels, setLabels] = useState<readonly Label[]>([]);
  useEditorKeys();
  useGoToKeys();
  useTaskKeys();
  useEffect(() => {
    if (container.current === null || vehicleCanvas.current === null) return undefined;
    const bound = bindScene(container.current, vehicleCanvas.current, setLabels);
    scene.current = bound.scene;
    return bound.dispose;
  }, []);
  return (
    <section class={`map${mapToolInHand.value ? " drawing" : ""}`} aria-label="Map">
      <div class="map-canvas" ref={container} />
      <canvas class="map-vehicles" aria-hidden="true" ref={vehicleCanvas} />
      <GridLabels labels={labels} />
      <span class="map-cross" aria-hidden="true" />
      <MapToolbar />
      <GoToHint />
      <TaskHint />
      {tiles !== null && tiles.by !== "" && <small class="map-makers">{tiles.by}</small>}
      <MapScale />
      <MapTools scene={() => scene.current} />
    </section>
  );
}

function GridLabels({ labels }: { labels: readonly Label[] }) {
  return (
    <div class="grid-labels" aria-hidden="true">
      {labels.map(({ edge, at_px, text }) => (
        <span key={edge + text} class={`edge-${edge}`} style={edge === "top" ? { left: `${at_px}px` } : { top: `${at_px}px` }}>
          {text}
        </span>
      ))}
    </div>
  );
}

function MapTools({ scene }: { scene: () => Scene | null }) {
  const showAll = () => {
    following.value = false;
    const points = Object.values(vehicles.value).map(vehiclePoint).filter((at) => at !== null);
    const plan = shownPlan.value;
    const bounds = boundsAround([...points, ...(plan === null ? [] : planPoints(plan.view))]);
    if (bounds !== null) scene()?.fit(bounds);
  };
  return (
    <div class="map-tools">
      <Tool icon="plus" label="Zoom in" onClick={() => scene()?.zoomBy(1)} />
      <Tool icon="minus" label="Zoom out" onClick={() => scene()?.zoomBy(-1)} />
      <Tool icon="fit" label="Show all" onClick={showAll} />
      {selectedVehicle.value && (
        <Tool icon="follow" label={`Follow ${selectedVehicle.value.id}`} pressed={following.value} onClick={() => (following.value = !following.value)} />
      )}
    </div>
  );
}

interface ToolProps {
  icon: IconName;
  label: string;
  pressed?: boolean;
  onClick: () => void;
}

function Tool({ icon, label, pressed, onClick }: ToolProps) {
  return (
    <button type="button" class="icon-button" aria-label={label} title={label} aria-pressed={pressed} onClick={onClick}>
      <Icon name={icon} />
    </button>
  );
}
