import { describe, expect, it } from "vitest";
import { circleRing, metresBetween, offset } from "./geometry";

describe("geometry", () => {
  it("measures a degree of latitude", () => {
    expect(metresBetween([8, 47], [8, 48])).toBeCloseTo(111_195, -1);
  });

  it("draws a circle whose points all have the radius", () => {
    const ring = circleRing([8, 47], 250);
    for (const point of ring) expect(metresBetween([8, 47], point)).toBeCloseTo(250, 0);
    expect(ring[0]?.map((x) => x.toFixed(9))).toEqual(ring.at(-1)?.map((x) => x.toFixed(9)));
  });

  it("goes clockwise from north", () => {
    expect(offset([8, 47], 100, 90)[0]).toBeGreaterThan(8);
  });
});
