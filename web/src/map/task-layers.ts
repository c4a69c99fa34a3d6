/** How a task queue is drawn: the current task strong, those to come lighter, the one being added dashed. */

import type { ExpressionSpecification, FilterSpecification, LayerSpecification } from "maplibre-gl";
import { ROUND, text, type Look } from "./look";

export function taskLayers({ palette: p, scale }: Look): LayerSpecification[] {
  const state: ExpressionSpecification = ["get", "state"];
  const current: ExpressionSpecification = ["==", state, "current"];
  const is = (kind: string, ...more: ExpressionSpecification[]): FilterSpecification => ["all", ["==", ["get", "kind"], kind], ...more];
  const source = "tasks";
  const width: ExpressionSpecification = ["case", current, 3.5 * scale, 2 * scale];
  return [
    { id: "taskWay", type: "line", source, filter: is("way"), layout: { ...ROUND }, paint: { "line-color": p.warn, "line-width": 1.4 * scale, "line-dasharray": [1, 3], "line-opacity": 0.8 } },
    { id: "taskCasing", type: "line", source, filter: is("course"), layout: { ...ROUND }, paint: { "line-color": p.halo, "line-width": 6 * scale, "line-opacity": 0.7 } },
    { id: "taskCourse", type: "line", source, filter: is("course", ["!=", state, "draft"]), layout: { ...ROUND }, paint: { "line-color": p.warn, "line-width": width, "line-opacity": ["case", current, 1, 0.7] } },
    { id: "taskDraft", type: "line", source, filter: is("course", ["==", state, "draft"]), paint: { "line-color": p.text, "line-width": 2 * scale, "line-dasharray": [3, 2] } },
    {
      id: "taskArrow",
      type: "symbol",
      source,
      filter: is("course"),
      layout: { "symbol-placement": "line", "symbol-spacing": 70 * scale, "icon-image": "arrow", "icon-size": scale, "icon-rotation-alignment": "map", "icon-allow-overlap": true, "icon-ignore-placement": true },
    },
    { id: "taskCorner", type: "circle", source, filter: is("corner"), paint: { "circle-radius": 4 * scale, "circle-color": p.background, "circle-stroke-color": ["match", state, "draft", p.text, p.warn], "circle-stroke-width": 2 * scale } },
    {
      id: "taskPlace",
      type: "circle",
      source,
      filter: is("number"),
      paint: {
        "circle-radius": ["case", current, 11 * scale, 9 * scale],
        "circle-color": ["case", current, p.warn, p.background],
        "circle-stroke-color": ["match", state, "draft", p.text, p.warn],
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "taskNumber",
      type: "symbol",
      source,
      filter: is("number"),
      layout: { ...text("label", 11 * scale), "text-allow-overlap": true, "text-ignore-placement": true },
      paint: { "text-color": ["case", current, p.background, p.text] },
    },
  ];
}
