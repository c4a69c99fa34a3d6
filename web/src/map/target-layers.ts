/** How a moving target is drawn: a square where it is by now, dashes where it goes, a ring where it is met. */

import type { ExpressionSpecification, FilterSpecification, LayerSpecification } from "maplibre-gl";
import { ROUND, text, textPaint, type Look } from "./look";

export function targetLayers({ palette: p, scale }: Look): LayerSpecification[] {
  const kind: ExpressionSpecification = ["get", "kind"];
  const is = (...kinds: string[]): FilterSpecification => ["in", kind, ["literal", kinds]];
  const source = "targets";
  const colour: ExpressionSpecification = ["match", kind, "stale", p.vehicleStale, p.drop];
  return [
    { id: "targetBound", type: "line", source, filter: is("bound"), layout: { ...ROUND }, paint: { "line-color": p.drop, "line-width": 1.4 * scale, "line-dasharray": [4, 3], "line-opacity": 0.6 } },
    { id: "targetWay", type: "line", source, filter: is("way"), layout: { ...ROUND }, paint: { "line-color": p.drop, "line-width": 2.4 * scale, "line-dasharray": [0.5, 2] } },
    { id: "targetMeet", type: "circle", source, filter: is("meet"), paint: { "circle-radius": 13 * scale, "circle-opacity": 0, "circle-stroke-color": p.drop, "circle-stroke-width": 2 * scale } },
    { id: "targetIcon", type: "symbol", source, filter: is("target", "stale"), layout: { "icon-image": ["concat", "target:", kind], "icon-size": scale, "icon-allow-overlap": true } },
    { id: "targetText", type: "symbol", source, filter: is("target", "stale", "meet"), layout: { ...text("label", 12 * scale), "text-anchor": "top", "text-offset": [0, 1.1], "text-optional": true }, paint: { ...textPaint(p.text, p), "text-color": colour } },
  ];
}
