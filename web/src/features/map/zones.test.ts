import { expect, test } from "vitest";
import { readZones, zoneBounds } from "./zones";

const RING = [
  [
    [8.5, 47.3],
    [8.6, 47.3],
    [8.6, 47.4],
    [8.5, 47.3],
  ],
];
const POLYGON = { type: "Polygon", coordinates: RING };
const text = (value: unknown) => JSON.stringify(value);

test("of a file its geometries and names are kept, and nothing else", () => {
  const { data } = readZones(
    "airport",
    text({
      type: "FeatureCollection",
      features: [
        { type: "Feature", properties: { name: "CTR", url: "javascript:alert(1)" }, geometry: POLYGON, id: 7 },
      ],
    }),
  );
  expect(data.features).toEqual([{ type: "Feature", properties: { label: "CTR" }, geometry: POLYGON }]);
});

test("a single feature and a bare geometry are files too", () => {
  expect(readZones("one", text({ type: "Feature", properties: null, geometry: POLYGON })).data.features).toHaveLength(
    1,
  );
  expect(zoneBounds(readZones("bare", text(POLYGON)))).toEqual([8.5, 47.3, 8.6, 47.4]);
});

test.each([
  ["no JSON", "{", "not JSON"],
  ["no GeoJSON", text({ version: 1 }), "not GeoJSON"],
  ["nothing in it", text({ type: "FeatureCollection", features: [] }), "no features"],
  ["a feature without a geometry", text({ type: "Feature", geometry: null }), "Feature 1 has no geometry"],
  ["an unknown geometry", text({ type: "Feature", geometry: { type: "Circle" } }), "type Circle"],
  ["metres instead of degrees", text({ type: "Point", coordinates: [2_683_000, 1_247_000] }), "in degrees"],
  ["text instead of numbers", text({ type: "Point", coordinates: ["8", "47"] }), "in degrees"],
  ["a line without points", text({ type: "LineString", coordinates: [] }), "no coordinates"],
  ["too much", `"${"x".repeat(1_000_001)}"`, "larger than 1 MB"],
])("%s is refused in words", (_, file, words) => {
  expect(() => readZones("file", file)).toThrow(words);
});
