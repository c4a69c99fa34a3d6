/** Zones of other makers on the map: GeoJSON files, drawn and never executed or sent anywhere. Pure. */

import type { Feature, FeatureCollection, Geometry } from "geojson";
import { boundsOf, type Point } from "../../geo/geometry";

export interface Zones {
  readonly name: string;
  readonly data: FeatureCollection;
}

/** In bytes: browsers keep about five million for a page. */
export const LARGEST_ZONES = 1_000_000;
const MOST_POSITIONS = 20_000;
const DEPTHS: Readonly<Record<string, number>> = {
  Point: 0,
  MultiPoint: 1,
  LineString: 1,
  MultiLineString: 2,
  Polygon: 2,
  MultiPolygon: 3,
};

/** Throws an Error that says in words what is wrong with the file. */
export function readZones(name: string, text: string): Zones {
  if (text.length > LARGEST_ZONES) throw new Error("The file is larger than 1 MB. Simplify it, or split it.");
  let document: unknown;
  try {
    document = JSON.parse(text);
  } catch {
    throw new Error("The file is not JSON.");
  }
  const features = featuresOf(document).map(drawable);
  if (features.length === 0) throw new Error("The file has no features.");
  const count = features.reduce((sum, { geometry }) => sum + positionsOf(geometry).length, 0);
  if (count > MOST_POSITIONS)
    throw new Error(`The file has ${count} positions. At most ${MOST_POSITIONS} can be drawn.`);
  return { name, data: { type: "FeatureCollection", features } };
}

export function zoneBounds({ data }: Zones): [number, number, number, number] | null {
  return boundsOf(data.features.flatMap(({ geometry }) => positionsOf(geometry)));
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function featuresOf(document: unknown): unknown[] {
  if (isRecord(document) && document["type"] === "FeatureCollection" && Array.isArray(document["features"]))
    return document["features"];
  if (isRecord(document) && (document["type"] === "Feature" || String(document["type"]) in DEPTHS)) return [document];
  throw new Error('The file is not GeoJSON: its "type" must be FeatureCollection, Feature or a geometry.');
}

/** Only what is drawn is kept: the geometry and a name. */
function drawable(value: unknown, index: number): Feature {
  const given = isRecord(value) ? value : {};
  const geometry = given["type"] === "Feature" ? given["geometry"] : given;
  const where = `Feature ${index + 1}`;
  if (!isRecord(geometry)) throw new Error(`${where} has no geometry.`);
  const depth = DEPTHS[String(geometry["type"])];
  if (depth === undefined) throw new Error(`${where} has a geometry of type ${String(geometry["type"])}.`);
  checkPositions(geometry["coordinates"], depth, where);
  const properties = isRecord(given["properties"]) ? given["properties"] : {};
  const label = [properties["name"], properties["title"]].find((one) => typeof one === "string") ?? "";
  const kept = { type: geometry["type"], coordinates: geometry["coordinates"] } as Geometry;
  return { type: "Feature", properties: { label }, geometry: kept };
}

function checkPositions(value: unknown, depth: number, where: string): void {
  if (!Array.isArray(value) || value.length === 0) throw new Error(`${where} has no coordinates.`);
  if (depth > 0) {
    for (const part of value) checkPositions(part, depth - 1, where);
    return;
  }
  const [lon, lat]: unknown[] = value;
  const inRange = (one: unknown, most: number) => typeof one === "number" && Math.abs(one) <= most;
  if (!inRange(lon, 180) || !inRange(lat, 90))
    throw new Error(`${where} has a position that is not longitude and latitude in degrees (WGS 84).`);
}

function positionsOf(geometry: Geometry): Point[] {
  const walk = (value: unknown): Point[] => {
    if (!Array.isArray(value)) return [];
    return typeof value[0] === "number" ? [[value[0], Number(value[1])]] : value.flatMap(walk);
  };
  return "coordinates" in geometry ? walk(geometry.coordinates) : [];
}
