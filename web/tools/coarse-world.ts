/**
 * Makes src/features/map/world.json, the coarse world that ships with the page, from the npm package
 * `world-atlas`: Natural Earth 1:50m, public domain (naturalearthdata.com); the package itself is ISC-licensed.
 *
 * `npm run world` writes the file; its test compares.
 */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import type { Feature, Geometry, MultiPolygon, Polygon, Position } from "geojson";
import { feature } from "topojson-client";
import { filter, filterWeight, presimplify, simplify } from "topojson-simplify";
import type { GeometryCollection, Topology } from "topojson-specification";

/** About 1 km, as the lines themselves are. */
const DECIMALS = 2;
/** What changes an outline by less (square degrees) is left out, and so are islands that small: the page loads faster. */
const LEAST_DETAIL = 0.01;
/** Labels of smaller countries would only crowd the map: square degrees. */
const LEAST_LABELLED = 8;

type Country = Feature<Polygon | MultiPolygon, { name: string }>;

/** GeoJSON with countries as areas, and a point for each larger one's name. */
export function coarseWorld(): string {
  const file = createRequire(import.meta.url).resolve("world-atlas/countries-50m.json");
  const atlas = JSON.parse(readFileSync(file, "utf8")) as Topology<{ countries: GeometryCollection<{ name: string }> }>;
  const detailed = presimplify(atlas);
  const coarse = filter(simplify(detailed, LEAST_DETAIL), filterWeight(detailed, LEAST_DETAIL)) as typeof atlas;
  const areas = feature(coarse, coarse.objects.countries).features.filter(isArea).map(flat);
  const features = [
    ...areas.map(({ properties: { name }, geometry: { type, coordinates } }) => ({
      type: "Feature",
      properties: { kind: "land", name },
      geometry: { type, coordinates: rounded(coordinates) },
    })),
    ...areas.flatMap(labelOf),
  ];
  return `{"type":"FeatureCollection","features":[\n${features.map((one) => JSON.stringify(one)).join(",\n")}\n]}\n`;
}

/** Some have become too small to be drawn. */
function isArea(one: Feature<Geometry | null, { name: string }>): one is Country {
  return one.geometry !== null && "coordinates" in one.geometry && one.geometry.coordinates.length > 0;
}

/** The package joins what lies on both sides of 180°, as on a globe: a map would draw lines all around the world. */
function flat(country: Country): Country {
  const { geometry } = country;
  return geometry.type === "Polygon"
    ? { ...country, geometry: { ...geometry, coordinates: geometry.coordinates.map(unwrapped) } }
    : { ...country, geometry: { ...geometry, coordinates: geometry.coordinates.map((part) => part.map(unwrapped)) } };
}

/** A ring whose longitudes go on beyond 180°. One around a pole is closed along it. */
function unwrapped(ring: readonly Position[]): Position[] {
  let turns_deg = 0;
  const line = ring.map(([lon = 0, lat = 0], i): Position => {
    const step_deg = lon - (ring[i - 1]?.[0] ?? lon);
    if (Math.abs(step_deg) > 180) turns_deg -= Math.sign(step_deg) * 360;
    return [lon + turns_deg, lat];
  });
  const [first, last] = [line[0], line.at(-1)];
  if (first === undefined || last === undefined || first[0] === last[0]) return line;
  const pole_deg = Math.sign(first[1] ?? 0) * 90;
  return [...line, [last[0] ?? 0, pole_deg], [first[0] ?? 0, pole_deg], first];
}

function rounded(coordinates: unknown): unknown {
  if (Array.isArray(coordinates)) return coordinates.map(rounded);
  return Number(Number(coordinates).toFixed(DECIMALS));
}

/** In the middle of its largest part. */
function labelOf({ properties: { name }, geometry }: Country): object[] {
  const parts = geometry.type === "Polygon" ? [geometry.coordinates] : geometry.coordinates;
  const middles = parts.map((part) => middleOf(part[0] ?? []));
  const largest = middles.reduce((best, one) => (one.area > best.area ? one : best));
  if (largest.area < LEAST_LABELLED) return [];
  return [
    {
      type: "Feature",
      properties: { kind: "name", name },
      geometry: { type: "Point", coordinates: rounded(largest.at) },
    },
  ];
}

/** Area and centroid of a ring, as on paper. */
function middleOf(ring: readonly Position[]): { area: number; at: Position } {
  let [area, x, y] = [0, 0, 0];
  ring.slice(1).forEach(([lon = 0, lat = 0], i) => {
    const [before_lon = 0, before_lat = 0] = ring[i] ?? [];
    const cross = before_lon * lat - lon * before_lat;
    area += cross / 2;
    x += (before_lon + lon) * cross;
    y += (before_lat + lat) * cross;
  });
  return { area: Math.abs(area), at: [x / (6 * area), y / (6 * area)] };
}
