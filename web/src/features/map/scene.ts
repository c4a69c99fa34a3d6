/** The MapLibre map behind a small face: data in by source, view changes out. Draws at most once per frame. */

import type { FeatureCollection } from "geojson";
import {
  type GeoJSONSource,
  Map as GlMap,
  type MapLayerMouseEvent,
  type MapLayerTouchEvent,
  type MapMouseEvent,
  type MapTouchEvent,
  setWorkerUrl,
} from "maplibre-gl";
import workerUrl from "maplibre-gl/dist/maplibre-gl-worker.mjs?url";
import type { Point } from "../../geo/geometry";
import type { MapExtent } from "../../store/map-view";
import { isOfBasemap } from "./basemap-layers";
import { LAND_LAYER } from "./coarse-world";
import { drawIcon } from "./icons";
import type { MapLook } from "./look";
import { buildStyle, type MapData, NO_DATA, type SourceId } from "./style";
import { VehicleLayer } from "./vehicle-layer";
import type { VehicleMark } from "./vehicle-marks";

setWorkerUrl(workerUrl); // from our own origin, so that the page's content security policy needs no blob:

interface MapSceneEvents {
  onView(view: MapExtent): void;
  onVehicle(id: string): unknown;
  onPlace(id: string): unknown;
  /** The user moved the map. */
  onGrab(): void;
  /** A click anywhere, on things too. */
  onMap(at: Point): void;
  onDoubleClick(): void;
  /** The chosen map does not come. */
  onBasemapError(error: { readonly message: string }): void;
  /** The country in the middle, null at sea and where it is not known. */
  onCountry(name: string | null): void;
  /** The user grips a handle; true allows the drag. */
  onGrip(role: string, pointer: string): boolean;
  onDrag(at: Point): void;
  onLetGo(): void;
}

export class MapScene {
  readonly #map: GlMap;
  readonly #data: MapData = { ...NO_DATA };
  readonly #texts = new Map<SourceId, string>();
  readonly #dirty = new Set<SourceId>();
  #look: MapLook;
  #frame = 0;
  #countryAt = "";
  readonly #vehicles: VehicleLayer;

  constructor(
    container: HTMLElement,
    above: HTMLCanvasElement,
    look: MapLook,
    private readonly events: MapSceneEvents,
  ) {
    this.#look = look;
    this.#map = new GlMap({
      container,
      style: buildStyle(look, this.#data),
      center: [8.5, 47.4],
      zoom: 3,
      maxZoom: 21,
      attributionControl: { compact: false }, // shown as soon as a source has one
      dragRotate: false,
      pitchWithRotate: false,
      touchPitch: false,
      fadeDuration: 0,
      locale: { "Map.Title": "Map: arrow keys move, plus and minus zoom" },
    });
    this.#map.touchZoomRotate.disableRotation();
    this.#map.keyboard.disableRotation();
    this.#map.setMissingStyleImageResolver((name) => this.#addIcon(name));
    this.#vehicles = new VehicleLayer(above, this.#map, look);
    this.#listen();
  }

  setVehicles(marks: readonly VehicleMark[]): void {
    this.#vehicles.setMarks(marks);
  }

  setTails(lines: readonly (readonly Point[])[]): void {
    this.#vehicles.setTails(lines);
  }

  /** Nothing is drawn for data that is as before: telemetry brings the same again and again while vehicles stand. */
  setData(source: SourceId, data: FeatureCollection): void {
    const text = JSON.stringify(data);
    if (text === this.#texts.get(source)) return;
    this.#texts.set(source, text);
    this.#data[source] = data;
    this.#dirty.add(source);
    this.#flushSoon();
  }

  setLook(look: MapLook): void {
    const before = this.#look;
    if (look.palette === before.palette && look.scale === before.scale && look.basemapLayers === before.basemapLayers)
      return;
    this.#look = look;
    this.#vehicles.setLook(look);
    this.#map.setStyle(buildStyle(look, this.#data), { diff: false }); // icons are coloured: all are drawn anew
  }

  fit(bounds: [number, number, number, number]): void {
    const { clientWidth, clientHeight } = this.#map.getContainer();
    this.#map.fitBounds(bounds, {
      padding: Math.min(70, Math.min(clientWidth, clientHeight) / 6),
      maxZoom: 17.5,
      duration: 500,
    });
  }

  /** Without a zoom, nothing moves if it is there already: a vehicle that stands is followed ten times a second. */
  centre(at: [number, number], zoom?: number): void {
    const [wanted, middle] = [this.#map.project(at), this.#map.project(this.#map.getCenter())];
    if (zoom === undefined && wanted.dist(middle) < 1) return;
    this.#map.easeTo({
      center: at,
      duration: 300,
      ...(zoom === undefined ? {} : { zoom: Math.max(zoom, this.#map.getZoom()) }),
    });
  }

  zoomBy(levels: number): void {
    this.#map.easeTo({ zoom: this.#map.getZoom() + levels, duration: 200 });
  }

  /** While something is drawn, a double click ends it and does not zoom. */
  setDrawing(drawing: boolean): void {
    if (drawing) this.#map.doubleClickZoom.disable();
    else this.#map.doubleClickZoom.enable();
  }

  shows(at: [number, number]): boolean {
    return this.#map.getBounds().contains(at);
  }

  project(at: [number, number]): { x: number; y: number } {
    return this.#map.project(at);
  }

  destroy(): void {
    cancelAnimationFrame(this.#frame);
    this.#vehicles.destroy();
    this.#map.remove();
  }

  #listen(): void {
    const map = this.#map;
    map.on("style.load", () => this.#flush());
    map.on("error", (event) => {
      // without its map the page works as before
      if ("sourceId" in event && isOfBasemap(event.sourceId)) this.events.onBasemapError(event.error);
      else console.error(event.error);
    });
    map.on("idle", () => this.#tellCountry());
    const tellView = () => this.events.onView(this.#view());
    map.on("load", tellView);
    map.on("move", tellView);
    map.on("resize", tellView);
    map.on("resize", () => this.#vehicles.resized());
    map.on("render", () => this.#vehicles.draw());
    map.on("dragstart", () => this.events.onGrab());
    map.on("touchstart", () => this.events.onGrab());
    map.on("click", ({ lngLat }) => this.events.onMap([lngLat.lng, lngLat.lat]));
    map.on("dblclick", () => this.events.onDoubleClick());
    enableHandleDragging(map, ["handles", "places"], this.events);
    map.on("click", "places", ({ features }) => {
      const id: unknown = features?.[0]?.properties?.["id"];
      if (typeof id === "string") this.events.onPlace(id);
    });
    map.on("click", ({ point }) => {
      const id = this.#vehicles.at(point);
      if (id !== null) this.events.onVehicle(id);
    });
    pointAt(map, ({ point }) => this.#vehicles.at(point) !== null);
  }

  /** A name of ours, or one of a chosen map that is in no sprite: that is drawn as nothing. */
  #addIcon(name: string): void {
    if (this.#map.hasImage(name)) return;
    const icon = drawIcon(name, this.#look.palette);
    if (icon === null) this.#map.addImage(name, new ImageData(1, 1));
    else this.#map.addImage(name, icon.image, { pixelRatio: icon.pixelRatio });
  }

  /** Which country the middle of the map is in, by the coarse world. */
  #tellCountry(): void {
    const { lng, lat } = this.#map.getCenter();
    const at = `${lng.toFixed(3)} ${lat.toFixed(3)}`;
    if (at === this.#countryAt || this.#map.getLayer(LAND_LAYER) === undefined) return;
    this.#countryAt = at;
    const [found] = this.#map.queryRenderedFeatures(this.#map.project([lng, lat]), { layers: [LAND_LAYER] });
    const name: unknown = found?.properties["name"];
    this.events.onCountry(typeof name === "string" ? name : null);
  }

  #view(): MapExtent {
    const bounds = this.#map.getBounds();
    const { clientWidth: width_px, clientHeight: height_px } = this.#map.getContainer();
    return {
      west: bounds.getWest(),
      south: bounds.getSouth(),
      east: bounds.getEast(),
      north: bounds.getNorth(),
      width_px,
      height_px,
    };
  }

  #flushSoon(): void {
    this.#frame ||= requestAnimationFrame(() => this.#flush());
  }

  #flush(): void {
    this.#frame = 0;
    for (const id of this.#dirty) {
      const source = this.#map.getSource<GeoJSONSource>(id);
      if (!source) return; // the style is still loading; it is built with the data, and what changed since stays dirty
      source.setData(this.#data[id]);
      this.#dirty.delete(id);
    }
  }
}

/** Over what can be clicked and not dragged. Handles have a pointer of their own, which counts before it. */
function pointAt(map: GlMap, isOver: (event: MapMouseEvent) => boolean): void {
  map.on("mousemove", (event) => {
    const { style } = map.getCanvas();
    if (style.cursor === "" || style.cursor === "pointer") style.cursor = isOver(event) ? "pointer" : "";
  });
}

// Dragging of what can be taken hold of, by mouse or finger. Without a handle under it the map itself is dragged.

interface HandleEvents {
  /** True lets it be dragged. */
  onGrip(role: string, pointer: string): boolean;
  onDrag(at: Point): void;
  onLetGo(): void;
}

/** Less is the tremble of a click. */
const LEAST_MOVE_PX = 4;

function enableHandleDragging(map: GlMap, layers: readonly string[], events: HandleEvents): void {
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

/** Until the pointer is released, anywhere on the page. */
function follow(
  map: GlMap,
  start: { readonly x: number; readonly y: number },
  events: HandleEvents,
  done: () => void,
): void {
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
