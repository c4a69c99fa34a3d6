/** The map's own background: meridians and parallels at a step that fits the zoom, needing no tiles. Pure. */

import type { Point } from "../../geo/geometry";
import type { MapExtent } from "../../store/map-view";

export interface Graticule {
  step_deg: number;
  /** Every fifth line is a major one. */
  major: Point[][];
  minor: Point[][];
  meridians_deg: number[];
  parallels_deg: number[];
}

const WISHED_SPACING_PX = 44;
const STEPS_DEG = [1, 2, 5]
  .flatMap((m) => [-6, -5, -4, -3, -2, -1, 0, 1].map((e) => m * 10 ** e))
  .sort((a, b) => a - b);

/** Lines that cover `view` and a margin around it, so that panning shows no edge. */
export function graticule(view: MapExtent): Graticule {
  const span = Math.max(view.east - view.west, 1e-6);
  const wished = (span / Math.max(view.width_px, 1)) * WISHED_SPACING_PX;
  const step_deg = STEPS_DEG.find((step) => step >= wished) ?? 30;
  const marginLon = span / 2;
  const marginLat = (view.north - view.south) / 2;
  const [west, east] = [Math.max(-180, view.west - marginLon), Math.min(180, view.east + marginLon)];
  const [south, north] = [Math.max(-85, view.south - marginLat), Math.min(85, view.north + marginLat)];

  const lines: Record<"major" | "minor", Point[][]> = { major: [], minor: [] };
  const kind = (index: number) => (index % 5 === 0 ? "major" : "minor");
  const meridians = indices(west, east, step_deg);
  const parallels = indices(south, north, step_deg);
  for (const i of meridians)
    lines[kind(i)].push([
      [i * step_deg, south],
      [i * step_deg, north],
    ]);
  for (const i of parallels)
    lines[kind(i)].push([
      [west, i * step_deg],
      [east, i * step_deg],
    ]);
  const majors = (all: number[]) => all.filter((i) => i % 5 === 0).map((i) => i * step_deg);
  return { step_deg, ...lines, meridians_deg: majors(meridians), parallels_deg: majors(parallels) };
}

/** A line's label with as many decimals as its step needs: 47.398° N. */
export function degreeLabel(value_deg: number, step_deg: number, letters: "EW" | "NS"): string {
  const decimals = Math.max(0, Math.ceil(-Math.log10(step_deg * 5) - 1e-9));
  const letter = Math.abs(value_deg) < 1e-9 ? "" : ` ${value_deg > 0 ? letters[0] : letters[1]}`;
  return `${Math.abs(value_deg).toFixed(decimals)}°${letter}`;
}

function indices(from: number, to: number, step: number): number[] {
  const list: number[] = [];
  for (let i = Math.ceil(from / step - 1e-9); i * step <= to + 1e-12; i++) list.push(i);
  return list;
}

// Where the graticule's labels stand: along the top for meridians, along the left for parallels. Pure.

export interface GridLabel {
  readonly edge: "top" | "left";
  readonly at_px: number;
  readonly text: string;
}

/** Room for the map's own corners. */
const MARGIN_PX = 36;

type Project = (at: [number, number]) => { x: number; y: number };

export function gridLabels(grid: Graticule, view: MapExtent, project: Project): GridLabel[] {
  const middle: [number, number] = [(view.west + view.east) / 2, (view.south + view.north) / 2];
  const inside = (px: number, size: number) => px > MARGIN_PX && px < size - MARGIN_PX;
  const top = grid.meridians_deg.map(
    (lon): GridLabel => ({
      edge: "top",
      at_px: project([lon, middle[1]]).x,
      text: degreeLabel(lon, grid.step_deg, "EW"),
    }),
  );
  const left = grid.parallels_deg.map(
    (lat): GridLabel => ({
      edge: "left",
      at_px: project([middle[0], lat]).y,
      text: degreeLabel(lat, grid.step_deg, "NS"),
    }),
  );
  return [
    ...top.filter((label) => inside(label.at_px, view.width_px)),
    ...left.filter((label) => inside(label.at_px, view.height_px)),
  ];
}
