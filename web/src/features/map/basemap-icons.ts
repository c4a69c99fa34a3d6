/** The few signs of Protomaps' style, drawn by our own code: road shields, towns, arrows, points of interest. */

import type { Palette } from "./look";

type Paint = (context: CanvasRenderingContext2D) => void;

const POINTS: ReadonlySet<string> = new Set(
  (
    "aerodrome animal beach bench bus_stop drinking_water ferry_terminal forest garden library marina park peak " +
    "school stadium toilets train_station university zoo"
  ).split(" "),
);
const SHIELD = /^(?:generic_shield|US:I|NL:S-road)-(\d)char$/;

/** Its size in pixels and how it is drawn around the middle; null for a name that is none of these. */
export function basemapIcon(name: string, p: Palette): { readonly size: number; readonly paint: Paint } | null {
  const letters = SHIELD.exec(name)?.[1];
  if (letters !== undefined) return { size: 42, paint: (c) => shield(c, Number(letters), p) };
  if (name === "townspot" || name === "capital")
    return { size: 10, paint: (c) => dot(c, name === "capital" ? 4 : 3, p) };
  if (name === "arrow") return { size: 14, paint: (c) => oneWay(c, p) };
  return POINTS.has(name) ? { size: 12, paint: (c) => dot(c, 3.5, p) } : null;
}

function shield(c: CanvasRenderingContext2D, letters: number, p: Palette): void {
  const width = 8 + 6 * letters;
  c.beginPath();
  c.roundRect(-width / 2, -7, width, 14, 3);
  c.fillStyle = p.background;
  c.fill();
  c.lineWidth = 1;
  c.strokeStyle = p.ringText;
  c.stroke();
}

function dot(c: CanvasRenderingContext2D, radius: number, p: Palette): void {
  c.beginPath();
  c.arc(0, 0, radius, 0, 2 * Math.PI);
  c.fillStyle = p.background;
  c.fill();
  c.lineWidth = 1.5;
  c.strokeStyle = p.ringText;
  c.stroke();
}

/** To the north: the style turns it. */
function oneWay(c: CanvasRenderingContext2D, p: Palette): void {
  c.strokeStyle = p.ringText;
  c.lineWidth = 1.2;
  c.stroke(new Path2D("M0 4.500V-4M-2.500-1.500L0-4 2.500-1.500"));
}
