import { distance, roundDistance } from "../format/units";
import { viewed } from "../map/camera";
import { metresBetween } from "../map/geometry";

const WIDEST_PX = 120;
/** The steps of round distances are at most so far apart. */
const STEP = 2.5;

/** How long a round distance is on the screen, in the middle of the map. */
export function MapScale() {
  const view = viewed.value;
  if (view === null || view.width_px === 0) return null;
  const middle = (view.south + view.north) / 2;
  const metresPerPixel = metresBetween([view.west, middle], [view.east, middle]) / view.width_px;
  if (!(metresPerPixel > 0) || view.east - view.west > 180) return null;
  const length_m = roundDistance((WIDEST_PX / STEP) * metresPerPixel);
  return (
    <span class="map-scale" style={{ width: `${(length_m / metresPerPixel).toFixed(0)}px` }} aria-hidden="true">
      {distance(length_m)}
    </span>
  );
}
