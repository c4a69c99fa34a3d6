import { expect, test } from "vitest";
import { coarseWorld } from "./coarse-world.ts";

test("the world that ships with the page is what its generator makes of the package", async () => {
  await expect(coarseWorld()).toMatchFileSnapshot("../src/features/map/world.json");
});

test("no outline goes around the world to get to the other side of 180°", () => {
  const world = JSON.parse(coarseWorld()) as { features: { geometry: { coordinates: unknown } }[] };
  const steps_deg = world.features
    .flatMap(({ geometry }) => ringsOf(geometry.coordinates))
    .filter((ring) => !ring.some(([, lat]) => Math.abs(lat ?? 0) === 90))
    .flatMap((ring) => ring.slice(1).map(([lon = 0], i) => Math.abs(lon - (ring[i]?.[0] ?? lon))));
  expect(Math.max(...steps_deg)).toBeLessThan(180);
});

/** All lists of positions, however deep. */
function ringsOf(coordinates: unknown): number[][][] {
  if (!Array.isArray(coordinates) || !Array.isArray(coordinates[0])) return [];
  return Array.isArray(coordinates[0][0]) ? coordinates.flatMap(ringsOf) : [coordinates as number[][]];
}
