/**
 * The vehicles' tails as lines on a canvas. On a map that is neither turned nor tilted the screen is linear in
 * Mercator's coordinates, so that each frame costs a multiplication for each point. Pure.
 */

import type { Point } from "../../geo/geometry";
import type { ScreenPoint } from "./vehicle-marks";

/** x and y in turn, as parts of the world's width, from its upper left corner. */
export type TailLine = Float64Array;

export function tailLine(line: readonly Point[]): TailLine {
  const flat = new Float64Array(2 * line.length);
  line.forEach(([lon, lat], i) => {
    flat[2 * i] = lon / 360 + 0.5;
    flat[2 * i + 1] = 0.5 - Math.asinh(Math.tan((lat * Math.PI) / 180)) / (2 * Math.PI);
  });
  return flat;
}

interface Projection {
  project(at: Point): ScreenPoint;
  getCenter(): { readonly lng: number };
}

type Path = Pick<CanvasRenderingContext2D, "moveTo" | "lineTo">;

/** Adds the lines to the canvas' path, each as far round the world as what is looked at. */
export function traceTails(path: Path, lines: readonly TailLine[], map: Projection): void {
  const lon = map.getCenter().lng;
  const [origin, further] = [map.project([lon, 0]), map.project([lon + 1, 0])];
  const world_px = (further.x - origin.x) * 360;
  const middle = lon / 360 + 0.5;
  for (const line of lines) {
    const left = origin.x + (Math.round(middle - (line[0] ?? 0)) - middle) * world_px;
    for (let i = 0; i < line.length; i += 2) {
      const x = left + (line[i] ?? 0) * world_px;
      const y = origin.y + ((line[i + 1] ?? 0) - 0.5) * world_px;
      if (i === 0) path.moveTo(x, y);
      else path.lineTo(x, y);
    }
  }
}
