/**
 * The map's style: our own sources and layers, a chosen map's below, the vehicles above (vehicle-layer).
 * No glyph server: texts are drawn with the page's typeface.
 */

import type { FeatureCollection } from "geojson";
import type { ExpressionSpecification, LayerSpecification, StyleSpecification } from "maplibre-gl";
import { worldBackground, worldLayers, worldSources } from "./coarse-world";
import { labelLayout, labelPaint, type MapLook, ROUND } from "./look";
import { targetLayers } from "./target-layers";
import { taskLayers } from "./task-layers";
import { toolLayers, zoneLayers } from "./tool-layers";

export const SOURCES = [
  "zones",
  "gridMinor",
  "gridMajor",
  "rings",
  "fences",
  "path",
  "release",
  "handles",
  "places",
  "drops",
  "sketch",
  "tools",
  "destination",
  "tasks",
  "targets",
] as const;
export type SourceId = (typeof SOURCES)[number];
export type MapData = Record<SourceId, FeatureCollection>;

const NOTHING: FeatureCollection = { type: "FeatureCollection", features: [] };
export const NO_DATA: MapData = Object.fromEntries(SOURCES.map((id) => [id, NOTHING])) as MapData;

export function buildStyle(look: MapLook, data: MapData): StyleSpecification {
  const { sources, layers, sprite, whole } = look.basemapLayers;
  return {
    version: 8,
    ...(sprite === undefined ? {} : { sprite }),
    sources: {
      ...(whole ? {} : worldSources()),
      ...sources,
      ...Object.fromEntries(SOURCES.map((id) => [id, { type: "geojson" as const, data: data[id], tolerance: 0.1 }])),
    },
    layers: [
      ...(whole ? [] : [worldBackground(look), ...worldLayers(look)]),
      ...layers,
      ...zoneLayers(look),
      ...backgroundLayers(look),
      ...planLayers(look),
      ...destinationLayers(look),
      ...taskLayers(look),
      ...targetLayers(look),
      ...sketchLayers(look),
      ...toolLayers(look),
    ],
  };
}

function backgroundLayers({ palette: p, scale, basemapLayers }: MapLook): LayerSpecification[] {
  const opacity = basemapLayers.layers.length === 0 ? 1 : 0.4; // a map has lines enough of its own
  const kind: ExpressionSpecification = ["get", "kind"];
  return [
    {
      id: "gridMinor",
      type: "line",
      source: "gridMinor",
      paint: { "line-color": p.gridMinor, "line-opacity": opacity },
    },
    {
      id: "gridMajor",
      type: "line",
      source: "gridMajor",
      paint: { "line-color": p.gridMajor, "line-opacity": opacity },
    },
    {
      id: "rings",
      type: "line",
      source: "rings",
      filter: ["==", kind, "ring"],
      paint: { "line-color": p.ring, "line-dasharray": [2, 4] },
    },
    {
      id: "home",
      type: "symbol",
      source: "rings",
      filter: ["==", kind, "home"],
      layout: { "icon-image": "mark:home", "icon-size": scale, "icon-allow-overlap": true },
    },
    {
      id: "fenceFill",
      type: "fill",
      source: "fences",
      paint: {
        "fill-color": ["match", kind, "exclusion", p.danger, p.ok],
        "fill-opacity": ["match", kind, "exclusion", 0.14, 0.04],
      },
    },
    {
      id: "fenceLine",
      type: "line",
      source: "fences",
      layout: { ...ROUND },
      paint: {
        "line-color": ["match", kind, "exclusion", p.danger, p.ok],
        "line-width": 1.5 * scale,
        "line-dasharray": [4, 3],
      },
    },
  ];
}

function planLayers(look: MapLook): LayerSpecification[] {
  const { palette: p, scale } = look;
  const state: ExpressionSpecification = ["get", "state"];
  return [
    {
      id: "pathCasing",
      type: "line",
      source: "path",
      filter: ["!=", state, "alternate"],
      layout: { ...ROUND },
      paint: { "line-color": p.pathCasing, "line-width": 6 * scale, "line-opacity": 0.8 },
    },
    {
      id: "path",
      type: "line",
      source: "path",
      filter: ["!=", state, "alternate"],
      layout: { ...ROUND },
      paint: {
        "line-color": ["match", state, "done", p.pathDone, p.info],
        "line-width": ["match", state, "current", 4 * scale, 2.5 * scale],
      },
    },
    {
      id: "pathElse",
      type: "line",
      source: "path",
      filter: ["==", state, "alternate"],
      layout: { ...ROUND },
      paint: { "line-color": p.drop, "line-width": 1.8 * scale, "line-dasharray": [1.5, 2.5] },
    },
    {
      id: "ringText",
      type: "symbol",
      source: "rings",
      filter: ["==", ["get", "kind"], "label"],
      layout: labelLayout("label", 11 * scale),
      paint: labelPaint(p.ringText, p),
    },
    ...releaseLayers(look),
    ...handleLayers(look),
    ...placeLayers(look),
  ];
}

/** The items of a plan, and its drops above them. */
function placeLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const state: ExpressionSpecification = ["get", "state"];
  return [
    {
      id: "places",
      type: "circle",
      source: "places",
      paint: {
        "circle-radius": ["case", ["get", "pointed"], 13 * scale, 9 * scale],
        "circle-color": ["match", state, "done", p.pathDone, "current", p.info, p.background],
        "circle-stroke-color": ["match", state, "done", p.pathDone, p.info],
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "placeText",
      type: "symbol",
      source: "places",
      layout: { ...labelLayout("label", 11 * scale), "text-allow-overlap": true },
      paint: { "text-color": ["match", state, "current", p.background, p.text] },
    },
    {
      id: "drops",
      type: "symbol",
      source: "drops",
      layout: {
        "icon-image": ["concat", "drop:", ["get", "outcome"]],
        "icon-anchor": "bottom",
        "icon-offset": [0, -10],
        "icon-size": scale,
        "icon-allow-overlap": true,
      },
    },
    {
      id: "dropText",
      type: "symbol",
      source: "drops",
      layout: { ...labelLayout("label", 12 * scale), "text-anchor": "left", "text-offset": [1.3, -2] },
      paint: labelPaint(p.text, p),
    },
  ];
}

/** Where a parcel leaves and comes down, and how far off it may. */
function releaseLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const kind: ExpressionSpecification = ["get", "kind"];
  return [
    {
      id: "releaseLine",
      type: "line",
      source: "release",
      filter: ["==", ["geometry-type"], "LineString"],
      layout: { ...ROUND },
      paint: {
        "line-color": p.drop,
        "line-width": 1.6 * scale,
        "line-dasharray": [1.5, 2.5],
        "line-opacity": ["match", kind, "allowed", 0.6, 1],
      },
    },
    {
      id: "releasePoint",
      type: "circle",
      source: "release",
      filter: ["==", ["geometry-type"], "Point"],
      paint: {
        "circle-radius": 4 * scale,
        "circle-color": ["match", kind, "release", p.drop, p.background],
        "circle-stroke-color": p.drop,
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "releaseText",
      type: "symbol",
      source: "release",
      filter: ["==", ["geometry-type"], "Point"],
      layout: {
        ...labelLayout("label", 11 * scale),
        "text-anchor": "top",
        "text-offset": [0, 0.7],
        "text-optional": true,
      },
      paint: labelPaint(p.drop, p),
    },
  ];
}

/** Seen are small dots; what takes hold of them is as large as a finger. */
function handleLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const role: ExpressionSpecification = ["get", "role"];
  return [
    {
      id: "handleDots",
      type: "circle",
      source: "handles",
      paint: {
        "circle-radius": ["match", role, "middle", 3.5 * scale, 5.5 * scale],
        "circle-color": ["match", role, ["rally", "home", "approach"], p.info, "alternate", p.drop, p.background],
        "circle-stroke-color": ["match", role, ["rally", "home", "approach", "alternate"], p.halo, p.text],
        "circle-stroke-width": 1.8 * scale,
        "circle-opacity": ["match", role, "middle", 0.6, 1],
        "circle-stroke-opacity": ["match", role, "middle", 0.6, 1],
      },
    },
    { id: "handles", type: "circle", source: "handles", paint: { "circle-radius": 13, "circle-opacity": 0 } },
  ];
}

function sketchLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  return [
    {
      id: "sketchLine",
      type: "line",
      source: "sketch",
      filter: ["==", ["geometry-type"], "LineString"],
      layout: { ...ROUND },
      paint: { "line-color": p.warn, "line-width": 2 * scale },
    },
    {
      id: "sketchPoint",
      type: "circle",
      source: "sketch",
      filter: ["==", ["geometry-type"], "Point"],
      paint: { "circle-radius": 5 * scale, "circle-color": p.warn },
    },
  ];
}

/** The destination of a vehicle under manual control. */
function destinationLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const colour = p.warn;
  return [
    {
      id: "destinationLine",
      type: "line",
      source: "destination",
      filter: ["==", ["geometry-type"], "LineString"],
      layout: { ...ROUND },
      paint: { "line-color": colour, "line-width": 2 * scale, "line-dasharray": [1, 2.5] },
    },
    {
      id: "destinationRing",
      type: "circle",
      source: "destination",
      filter: ["==", ["geometry-type"], "Point"],
      paint: {
        "circle-radius": 9 * scale,
        "circle-opacity": 0,
        "circle-stroke-color": colour,
        "circle-stroke-width": 2.5 * scale,
      },
    },
    {
      id: "destinationPoint",
      type: "circle",
      source: "destination",
      filter: ["==", ["geometry-type"], "Point"],
      paint: { "circle-radius": 2.5 * scale, "circle-color": colour },
    },
  ];
}
