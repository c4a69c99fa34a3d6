import { expect, it } from "vitest";
import type { Point } from "../../geo/geometry";
import { tailLine, traceTails } from "./vehicle-tails";

const WORLD_PX = 512 * 2 ** 15;

/** As MapLibre projects, with the place of `centre` in the middle of a screen. */
function cameraAt([lng, lat]: Point) {
  const y = (deg: number) => -Math.log(Math.tan(Math.PI / 4 + (deg * Math.PI) / 360)) / (2 * Math.PI);
  return {
    getCenter: () => ({ lng }),
    project: ([lon, deg]: Point) => ({
      x: 400 + ((lon - lng) / 360) * WORLD_PX,
      y: 300 + (y(deg) - y(lat)) * WORLD_PX,
    }),
  };
}

function traced(line: Point[], centre: Point): number[][] {
  const drawn: number[][] = [];
  const add = (x: number, y: number) => void drawn.push([x, y]);
  traceTails({ moveTo: add, lineTo: add }, [tailLine(line)], cameraAt(centre));
  return drawn;
}

it("lies where the map itself would draw it", () => {
  const line: Point[] = [
    [8.54, 47.39],
    [8.55, 47.4],
    [8.56, 47.38],
  ];
  const camera = cameraAt([8.545, 47.395]);
  traced(line, [8.545, 47.395]).forEach(([x, y], i) => {
    const wanted = camera.project(line[i] ?? [0, 0]);
    expect(x).toBeCloseTo(wanted.x, 3);
    expect(y).toBeCloseTo(wanted.y, 3);
  });
});

it("is seen from beyond the date line", () => {
  const [first = []] = traced(
    [
      [-179.999, 0],
      [-179.998, 0],
    ],
    [180.0005, 0],
  );
  expect(first[0]).toBeCloseTo(400 + (0.0005 / 360) * WORLD_PX, 3);
});
