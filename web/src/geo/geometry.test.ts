import { describe, expect, it } from "vitest";
import { arc, bearingBetween, circleRing, metresBetween, offset } from "./geometry";

describe("geometry", () => {
  it("measures a degree of latitude", () => {
    expect(metresBetween([8, 47], [8, 48])).toBeCloseTo(111_195, -1);
  });

  it("draws a circle whose points all have the radius", () => {
    const ring = circleRing([8, 47], 250);
    for (const point of ring) expect(metresBetween([8, 47], point)).toBeCloseTo(250, 0);
    expect(ring[0]?.map((x) => x.toFixed(9))).toEqual(ring.at(-1)?.map((x) => x.toFixed(9)));
  });

  it("takes bearings on the great circle, from north", () => {
    expect(bearingBetween([8, 47], [8, 48])).toBeCloseTo(0, 6);
    expect(bearingBetween([8, 47], [8, 46])).toBeCloseTo(180, 6);
    expect(bearingBetween([8.55, 47.38], [-73.78, 40.64])).toBeCloseTo(296, 0); // Zurich to New York
    expect(bearingBetween([179, 0], [-179, 0])).toBeCloseTo(90, 6);
  });

  it("draws a great circle that is as long as the distance, across the date line too", () => {
    const line = arc([179, 10], [-179, -5]);
    const length = line.slice(1).reduce((sum, at, i) => sum + metresBetween(line[i] ?? at, at), 0);
    expect(length).toBeCloseTo(metresBetween([179, 10], [-179, -5]), -1);
    expect(line.at(-1)?.[0]).toBeCloseTo(181, 6);
  });

  it("goes clockwise from north", () => {
    expect(offset([8, 47], 100, 90)[0]).toBeGreaterThan(8);
  });
});
