/**
 * Draws the vehicles and their tails on a canvas of their own above the map.
 *
 * Telemetry moves them ten times a second. In the map's WebGL each time would draw all of it anew, with grid, fences,
 * plans and tiles; here it costs a few milliseconds, also on a machine without a graphics card.
 */

import type { Point } from "../../geo/geometry";
import { drawIcon } from "./icons";
import { FONT, type MapLook } from "./look";
import { placeLabels } from "./vehicle-labels";
import { nearestIndex, type ScreenPoint, sameMarks, unwrapLongitude, type VehicleMark } from "./vehicle-marks";
import { type TailLine, tailLine, traceTails } from "./vehicle-tails";

/** What it needs of the map. */
interface MapProjection {
  project(at: Point): ScreenPoint;
  getCenter(): { readonly lng: number };
  getPixelRatio(): number;
}

const ICON_PX = 36;
const RING_PX = 22;
const REACH_PX = 18;
const LABEL_PX = 12;
const LABEL_AWAY_PX = 20;
const LINE_GAP_PX = 1;
/** Icons are kept larger than they are drawn: turned, they stay sharp. */
const FINER = 2;
/** Widths of labels that are kept; altitudes change, so that they would grow for ever. */
const WIDTHS = 2000;

export class VehicleLayer {
  readonly #context: CanvasRenderingContext2D;
  readonly #icons = new Map<string, HTMLCanvasElement>();
  readonly #widths = new Map<string, number>();
  #tails: readonly TailLine[] = [];
  #marks: readonly VehicleMark[] = [];
  /** As they were drawn: on a slow screen newer marks may wait, in another order. */
  #drawn: readonly VehicleMark[] = [];
  #places: readonly ScreenPoint[] = [];
  #size = { width: 0, height: 0, ratio: 0 };
  #fits = false;
  #frame = 0;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly camera: MapProjection,
    private look: MapLook,
  ) {
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("no 2d canvas in this browser");
    this.#context = context;
  }

  setLook(look: MapLook): void {
    this.look = look;
    this.#icons.clear();
    this.#widths.clear();
    this.#drawSoon();
  }

  resized(): void {
    this.#fits = false;
    this.#drawSoon();
  }

  /** Nothing is drawn for vehicles that stand still. */
  setMarks(marks: readonly VehicleMark[]): void {
    if (sameMarks(this.#marks, marks)) return;
    this.#marks = marks;
    this.#drawSoon();
  }

  setTails(lines: readonly (readonly Point[])[]): void {
    this.#tails = lines.map(tailLine);
    this.#drawSoon();
  }

  /** The vehicle at a place of the map. */
  at(place: ScreenPoint): string | null {
    const index = nearestIndex(this.#places, place, REACH_PX * this.look.scale);
    return index === null ? null : (this.#drawn[index]?.id ?? null);
  }

  /** At once: with the map's own frame, so that vehicles stay on their places while it moves. */
  draw(): void {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.#fitCanvas();
    const { width, height, ratio } = this.#size;
    const middle = this.camera.getCenter().lng;
    this.#drawn = this.#marks;
    this.#places = this.#marks.map(({ at: [lon, lat] }) => this.camera.project([unwrapLongitude(lon, middle), lat]));
    this.#context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.#context.clearRect(0, 0, width, height);
    this.#drawTails();
    const seen = this.#marks.flatMap((mark, i) => {
      const place = this.#places[i];
      const margin = 3 * ICON_PX * this.look.scale;
      const inside =
        place !== undefined &&
        place.x > -margin &&
        place.y > -margin &&
        place.x < width + margin &&
        place.y < height + margin;
      return inside ? [{ mark, place }] : [];
    });
    for (const { mark, place } of seen) {
      if (mark.selected) this.#drawRing(place);
      this.#drawIcon(mark, place);
    }
    this.#drawLabels(seen);
  }

  destroy(): void {
    cancelAnimationFrame(this.#frame);
  }

  #drawSoon(): void {
    this.#frame ||= requestAnimationFrame(() => this.draw());
  }

  #fitCanvas(): void {
    const ratio = this.camera.getPixelRatio();
    if (this.#fits && ratio === this.#size.ratio) return;
    this.#fits = true;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (ratio !== this.#size.ratio) this.#icons.clear();
    this.#size = { width, height, ratio };
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
  }

  #drawTails(): void {
    if (this.#tails.length === 0) return;
    const c = this.#context;
    c.beginPath();
    traceTails(c, this.#tails, this.camera);
    c.strokeStyle = this.look.palette.track;
    c.lineWidth = 2 * this.look.scale;
    c.lineJoin = "bevel";
    c.globalAlpha = 0.75;
    c.stroke();
    c.globalAlpha = 1;
  }

  #drawRing({ x, y }: ScreenPoint): void {
    const { palette, scale } = this.look;
    const c = this.#context;
    c.beginPath();
    c.arc(x, y, RING_PX * scale, 0, 2 * Math.PI);
    c.fillStyle = c.strokeStyle = palette.info;
    c.lineWidth = 1.5 * scale;
    c.globalAlpha = 0.16;
    c.fill();
    c.globalAlpha = 1;
    c.stroke();
  }

  #drawIcon({ icon, heading_deg }: VehicleMark, { x, y }: ScreenPoint): void {
    const image = this.#iconOf(icon);
    if (image === null) return;
    const size = ICON_PX * this.look.scale;
    const c = this.#context;
    c.save();
    c.translate(x, y);
    c.rotate((heading_deg * Math.PI) / 180);
    c.drawImage(image, -size / 2, -size / 2, size, size);
    c.restore();
  }

  /** Drawn once for a screen's resolution. */
  #iconOf(name: string): HTMLCanvasElement | null {
    const kept = this.#icons.get(name);
    if (kept !== undefined) return kept;
    const icon = drawIcon(name, this.look.palette);
    if (icon === null) return null;
    const drawn = document.createElement("canvas");
    drawn.width = icon.image.width;
    drawn.height = icon.image.height;
    drawn.getContext("2d")?.putImageData(icon.image, 0, 0);
    const fitted = document.createElement("canvas");
    fitted.width = fitted.height = Math.round(ICON_PX * this.look.scale * this.#size.ratio * FINER);
    const context = fitted.getContext("2d");
    if (context !== null) {
      context.imageSmoothingQuality = "high";
      context.drawImage(drawn, 0, 0, fitted.width, fitted.height);
    }
    this.#icons.set(name, fitted);
    return fitted;
  }

  #drawLabels(seen: readonly { readonly mark: VehicleMark; readonly place: ScreenPoint }[]): void {
    const { palette, scale } = this.look;
    const c = this.#context;
    const high = LABEL_PX * scale;
    c.font = `500 ${high}px ${FONT.join(", ")}`;
    c.textAlign = "center";
    c.textBaseline = "top";
    c.lineJoin = "round";
    c.lineWidth = 3.2 * scale;
    c.strokeStyle = palette.halo;
    const line = high + LINE_GAP_PX * scale;
    const labelled = seen.map(({ mark: { label, selected, stale }, place }) => ({ label, selected, stale, place }));
    for (const { lines, left, right, top } of placeLabels(labelled, {
      line,
      away: LABEL_AWAY_PX * scale,
      widthOf: (label) => this.#widthOf(label),
    })) {
      for (const [i, { label, stale }] of lines.entries()) {
        c.fillStyle = stale ? palette.ringText : palette.text;
        c.strokeText(label, (left + right) / 2, top + i * line);
        c.fillText(label, (left + right) / 2, top + i * line);
      }
    }
  }

  #widthOf(label: string): number {
    let width = this.#widths.get(label);
    if (width === undefined) {
      if (this.#widths.size >= WIDTHS) this.#widths.clear();
      width = this.#context.measureText(label).width;
      this.#widths.set(label, width);
    }
    return width;
  }
}
