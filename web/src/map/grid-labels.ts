/** Where the graticule's labels stand: along the top for meridians, along the left for parallels. Pure. */

import { degreeLabel, type Graticule, type View } from "./graticule";

export interface Label {
  readonly edge: "top" | "left";
  readonly at_px: number;
  readonly text: string;
}

/** Room for the map's own corners. */
const MARGIN_PX = 36;

type Project = (at: [number, number]) => { x: number; y: number };

export function gridLabels(grid: Graticule, view: View, project: Project): Label[] {
  const middle: [number, number] = [(view.west + view.east) / 2, (view.south + view.north) / 2];
  const inside = (px: number, size: number) => px > MARGIN_PX && px < size - MARGIN_PX;
  const top = grid.meridians_deg.map((lon): Label => ({ edge: "top", at_px: project([lon, middle[1]]).x, text: degreeLabel(lon, grid.step_deg, "EW") }));
  const left = grid.parallels_deg.map((lat): Label => ({ edge: "left", at_px: project([middle[0], lat]).y, text: degreeLabel(lat, grid.step_deg, "NS") }));
  return [...top.filter((label) => inside(label.at_px, view.width_px)), ...left.filter((label) => inside(label.at_px, view.height_px))];
}
