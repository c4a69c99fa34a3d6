/** Dragging of what can be taken hold of, by mouse or finger. Without a handle under it the map itself is dragged. */

import type { Map as GlMap, MapLayerMouseEvent, MapLayerTouchEvent, MapMouseEvent, MapTouchEvent } from "maplibre-gl";
import type { Point } from "./geometry";

export interface HandleEvents {
  /** True lets it be dragged. */
  onGrip(role: string, pointer: string): boolean;
  onDrag(at: Point): void;
  onLetGo(): void;
}

/** Less is the tremble of a click. */
const LEAST_MOVE_PX = 4;

export function listenToHandles(map: GlMap, layers: readonly string[], events: HandleEvents): void {
  let held = false;
  const grip = (event: MapLayerMouseEvent | MapLayerTouchEvent) => {
    const properties = event.features?.[0]?.properties;
    if (held || !events.onGrip(String(properties?.["role"]), String(properties?.["pointer"]))) return;
    held = true;
    event.preventDefault(); // the map stays where it is
    follow(map, event.point, events, () => (held = false));
  };
  for (const layer of layers) {
    map.on("mousedown", layer, (event) => event.originalEvent.button === 0 && grip(event));
    map.on("touchstart", layer, (event) => event.points.length === 1 && grip(event));
    map.on("mouseenter", layer, () => (map.getCanvas().style.cursor = "move"));
    map.on("mouseleave", layer, () => (map.getCanvas().style.cursor = ""));
  }
}

/** Until the pointer is let go, wherever on the page that is. */
function follow(map: GlMap, start: { readonly x: number; readonly y: number }, events: HandleEvents, done: () => void): void {
  let moved = false;
  const move = ({ point, lngLat }: MapMouseEvent | MapTouchEvent) => {
    moved ||= Math.hypot(point.x - start.x, point.y - start.y) >= LEAST_MOVE_PX;
    if (moved) events.onDrag([lngLat.lng, lngLat.lat]);
  };
  const ends = ["mouseup", "touchend", "touchcancel", "blur"] as const;
  const end = () => {
    map.off("mousemove", move);
    map.off("touchmove", move);
    for (const name of ends) window.removeEventListener(name, end);
    events.onLetGo();
    done();
  };
  map.on("mousemove", move);
  map.on("touchmove", move);
  for (const name of ends) window.addEventListener(name, end);
}
