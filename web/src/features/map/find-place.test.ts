import { describe, expect, it, test } from "vitest";
import type { Point } from "../../geo/geometry";
import { findPlace } from "./find-place";

const ZURICH: Point = [8.54, 47.37];

function expectNear(found: Point | null, [lon, lat]: Point): void {
  expect(found?.[0]).toBeCloseTo(lon, 4);
  expect(found?.[1]).toBeCloseTo(lat, 4);
}

describe("coordinates", () => {
  it.each([
    ["47.39, 8.54", [8.54, 47.39]],
    ["47.39 8.54", [8.54, 47.39]],
    ["-33.85;151.21", [151.21, -33.85]],
    ["33.85 S, 151.21 E", [151.21, -33.85]],
    ["8.54E 47.39N", [8.54, 47.39]],
    ["N47.39 E8.54", [8.54, 47.39]],
    ["47°23'51.9\"N 8°32'44.1\"E", [8.545583, 47.39775]],
    ["47° 23.865' N, 8° 32.735' E", [8.545583, 47.39775]],
    ["47:23:51.9, 8:32:44.1", [8.545583, 47.39775]],
  ] as [string, Point][])("%s", (text, at) => expectNear(findPlace(text, ZURICH), at));
});

describe("plus codes", () => {
  // of the specification's own test data, and of this project's home
  it.each([
    ["7FG49Q00+", [2.775, 20.375]],
    ["7FG49QCJ+2V", [2.7821875, 20.3700625]],
    ["7FG49QCJ+2VX", [2.78221875, 20.3701125]],
    ["8fvc9gxw+36", [8.5455625, 47.3977125]],
    ["9GXW+36 Zürich", [8.5455625, 47.3977125]],
    ["XW+36", [8.5455625, 47.3977125]],
  ] as [string, Point][])("%s", (text, at) => expectNear(findPlace(text, [8.54, 47.39]), at));

  it("a short one is the nearest there is, across the edges of its square too", () => {
    const [lon, lat] = findPlace("9GXW+36", [9.01, 47.01]) ?? [0, 0];
    expect(Math.abs(lon - 9.01) <= 0.5 && Math.abs(lat - 47.01) <= 0.5).toBe(true);
  });
});

test.each(["", "Zürich", "47.39", "97, 8", "47, 181", "1 2 3", "47 N, 8 N", "47°61' N, 8° E", "8FVC9GXW+3", "8F00+XW"])(
  "%s is no place",
  (text) => expect(findPlace(text, ZURICH)).toBeNull(),
);
