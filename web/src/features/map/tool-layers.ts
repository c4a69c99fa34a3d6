/** What the map's own tools draw: a measured distance, a place that was found, zones of files. Features are pure. */

import type { Feature, FeatureCollection } from "geojson";
import type { ExpressionSpecification, LayerSpecification } from "maplibre-gl";
import { formatDistance, formatHeading } from "../../format/units";
import { arc, bearingBetween, metresBetween, type Point } from "../../geo/geometry";
import { labelLayout, labelPaint, type MapLook, ROUND } from "./look";
import type { Zones } from "./zones";

/** "1.24 km, 057°": along the great circle, and its direction at the start. */
export function measuredText([from, to]: readonly Point[]): string | null {
  if (from === undefined || to === undefined) return null;
  return `${formatDistance(metresBetween(from, to))}, ${formatHeading(bearingBetween(from, to))}`;
}

export function toolFeatures(measured: readonly Point[], found: Point | null): FeatureCollection {
  const [from, to] = measured;
  const features: Feature[] = measured.map((at) => point(at, ""));
  if (from !== undefined && to !== undefined) {
    const line = arc(from, to);
    features.push({ type: "Feature", properties: {}, geometry: { type: "LineString", coordinates: line } });
    features.push(point(to, measuredText(measured) ?? ""));
  }
  if (found !== null) features.push({ ...point(found, ""), properties: { label: "", found: true } });
  return { type: "FeatureCollection", features };
}

function point(at: Point, label: string): Feature {
  return { type: "Feature", properties: { label }, geometry: { type: "Point", coordinates: at } };
}

export function zoneFeatures(files: readonly Zones[]): FeatureCollection {
  return { type: "FeatureCollection", features: files.flatMap(({ data }) => data.features) };
}

export function zoneLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  return [
    {
      id: "zoneFill",
      type: "fill",
      source: "zones",
      filter: ["==", ["geometry-type"], "Polygon"],
      paint: { "fill-color": p.warn, "fill-opacity": 0.1 },
    },
    {
      id: "zoneLine",
      type: "line",
      source: "zones",
      layout: { ...ROUND },
      paint: { "line-color": p.warn, "line-width": 1.5 * scale },
    },
    {
      id: "zonePoint",
      type: "circle",
      source: "zones",
      filter: ["==", ["geometry-type"], "Point"],
      paint: { "circle-radius": 4 * scale, "circle-color": p.warn },
    },
    {
      id: "zoneText",
      type: "symbol",
      source: "zones",
      layout: labelLayout("label", 11 * scale),
      paint: labelPaint(p.warn, p),
    },
  ];
}

export function toolLayers({ palette: p, scale }: MapLook): LayerSpecification[] {
  const found: ExpressionSpecification = ["has", "found"];
  return [
    {
      id: "toolLine",
      type: "line",
      source: "tools",
      filter: ["==", ["geometry-type"], "LineString"],
      layout: { ...ROUND },
      paint: { "line-color": p.text, "line-width": 1.8 * scale, "line-dasharray": [2, 2] },
    },
    {
      id: "toolPoint",
      type: "circle",
      source: "tools",
      filter: ["==", ["geometry-type"], "Point"],
      paint: {
        "circle-radius": ["case", found, 9 * scale, 4 * scale],
        "circle-color": p.text,
        "circle-opacity": ["case", found, 0, 1],
        "circle-stroke-color": ["case", found, p.text, p.halo],
        "circle-stroke-width": 2 * scale,
      },
    },
    {
      id: "toolText",
      type: "symbol",
      source: "tools",
      filter: ["==", ["geometry-type"], "Point"],
      layout: {
        ...labelLayout("label", 12 * scale),
        "text-anchor": "bottom",
        "text-offset": [0, -0.8],
        "text-allow-overlap": true,
      },
      paint: labelPaint(p.text, p),
    },
  ];
}
