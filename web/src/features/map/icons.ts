/**
 * The map's icons, drawn by our own code when the style first asks for one: vehicles by type, drops by outcome, moving
 * targets, directions, home.
 */

import type { DropOutcome, VehicleType } from "../../api/types";
import { basemapIcon } from "./basemap-icons";
import type { Palette } from "./look";

interface MapIcon {
  readonly image: ImageData;
  readonly pixelRatio: number;
}

const SCALE = 3; // sharp on every screen, and small enough to be drawn in a blink

/**
 * The icon with this name ("vehicle:vtol:ok", "drop:released", "target:stale", "mark:arrow", "mark:home"), or null if
 * there is none.
 */
export function drawIcon(name: string, palette: Palette): MapIcon | null {
  const [kind, first = "", second = ""] = name.split(":");
  switch (kind) {
    case "vehicle":
      return draw(36, (c) => vehicle(c, first, toneColor(second, palette), palette));
    case "drop":
      return draw(26, (c) => drop(c, first, palette));
    case "target":
      return draw(24, (c) => target(c, first === "stale" ? palette.vehicleStale : palette.drop, palette));
    case "mark":
      return first === "home" ? draw(22, (c) => home(c, palette)) : draw(14, (c) => arrow(c, palette));
    default: {
      const other = basemapIcon(name, palette);
      return other && draw(other.size, other.paint);
    }
  }
}

function draw(size: number, paint: (context: CanvasRenderingContext2D) => void): MapIcon {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size * SCALE;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("no 2d canvas in this browser");
  context.scale(SCALE, SCALE);
  context.translate(size / 2, size / 2);
  context.lineJoin = context.lineCap = "round";
  paint(context);
  return { image: context.getImageData(0, 0, canvas.width, canvas.height), pixelRatio: SCALE };
}

function toneColor(tone: string, p: Palette): string {
  return tone === "danger" ? p.danger : tone === "stale" ? p.vehicleStale : p.vehicle;
}

/** All point north: the style turns them to the heading. */
const OUTLINES: Readonly<Record<Exclude<VehicleType, "multicopter"> | "unknown", string>> = {
  fixed_wing:
    "M0-13C1.6-13 2.2-9 2.2-5L14 1V4L2.200 2.500 1.700 8.500 5 11V13L0 12-5 13V11L-1.700 8.500-2.200 2.500-14 4V1L-2.200-5C-2.200-9-1.600-13 0-13Z",
  vtol: "M0-13C1.6-13 2.2-9 2.2-5L14-1V2L2.200 2.500 1.700 8.500 5 11V13L0 12-5 13V11L-1.700 8.500-2.200 2.500-14 2V-1L-2.200-5C-2.200-9-1.600-13 0-13Z",
  rover: "M0-13L5-7H7.500V11H-7.500V-7H-5Z",
  airship: "M0-14C6-9 6.500 4 2.500 9L5 13H-5L-2.500 9C-6.500 4-6-9 0-14Z",
  unknown: "M0-12L9 11 0 6-9 11Z",
};

function vehicle(c: CanvasRenderingContext2D, type: string, color: string, p: Palette): void {
  if (type === "multicopter") {
    multicopter(c, color, p);
    return;
  }
  if (type === "vtol")
    rotors(
      c,
      [
        [-9, -6],
        [9, -6],
        [-9, 8],
        [9, 8],
      ],
      3.2,
      color,
      p,
    );
  const outline = new Path2D(OUTLINES[type as keyof typeof OUTLINES] ?? OUTLINES.unknown);
  c.lineWidth = 3;
  c.strokeStyle = p.halo;
  c.stroke(outline);
  c.fillStyle = color;
  c.fill(outline);
}

function multicopter(c: CanvasRenderingContext2D, color: string, p: Palette): void {
  const arms: [number, number][] = [
    [-8.5, -8.5],
    [8.5, -8.5],
    [-8.5, 8.5],
    [8.5, 8.5],
  ];
  for (const [width, style] of [
    [6, p.halo],
    [2.6, color],
  ] as const) {
    c.lineWidth = width;
    c.strokeStyle = style;
    c.beginPath();
    for (const [x, y] of arms) {
      c.moveTo(0, 0);
      c.lineTo(x, y);
    }
    c.stroke();
  }
  rotors(c, arms, 4.6, color, p);
  const nose = new Path2D("M0-10L5.500 4.500 0 1.500-5.500 4.500Z");
  c.lineWidth = 2.5;
  c.strokeStyle = p.halo;
  c.stroke(nose);
  c.fillStyle = color;
  c.fill(nose);
}

function rotors(
  c: CanvasRenderingContext2D,
  at: readonly [number, number][],
  radius: number,
  color: string,
  p: Palette,
): void {
  for (const [x, y] of at) {
    c.beginPath();
    c.arc(x, y, radius, 0, 2 * Math.PI);
    c.fillStyle = p.halo;
    c.fill();
    c.lineWidth = 1.6;
    c.strokeStyle = color;
    c.stroke();
  }
}

/** A parcel on a pin: hollow while it is to come, filled when it is decided. */
function drop(c: CanvasRenderingContext2D, outcome: string, p: Palette): void {
  const color = outcome === "released" ? p.ok : outcome === "unknown" ? p.danger : p.drop;
  const decided = outcome !== "pending";
  const pin = new Path2D("M-9-11H9V5H3.500L0 11-3.500 5H-9Z");
  c.fillStyle = decided ? color : p.background;
  c.fill(pin);
  c.lineWidth = 2;
  c.strokeStyle = color;
  c.stroke(pin);
  c.strokeStyle = decided ? p.background : color;
  c.lineWidth = 2;
  c.stroke(new Path2D(MARKS[outcome as keyof typeof MARKS] ?? MARKS.pending));
}

const MARKS: Readonly<Record<DropOutcome | "unconfirmed", string>> = {
  pending: "M0-8V1M-3.500-2.500L0 1 3.500-2.500",
  released: "M-4-3L-1 0 4.500-6",
  unconfirmed: "M-4-3L-1 0 4.500-6",
  kept: "M-4-3H4",
  unknown: "M-3-6L3 0M3-6L-3 0",
};

/** A moving delivery target: a diamond with its middle marked. */
function target(c: CanvasRenderingContext2D, color: string, p: Palette): void {
  const diamond = new Path2D("M0-9L9 0 0 9-9 0Z");
  for (const [width, style] of [
    [5, p.halo],
    [2.4, color],
  ] as const) {
    c.lineWidth = width;
    c.strokeStyle = style;
    c.stroke(diamond);
  }
  c.fillStyle = p.background;
  c.fill(diamond);
  c.fillStyle = color;
  c.fill(new Path2D("M0-4L4 0 0 4-4 0Z"));
}

function home(c: CanvasRenderingContext2D, p: Palette): void {
  c.fillStyle = p.background;
  c.strokeStyle = p.text;
  c.lineWidth = 1.8;
  const house = new Path2D("M-8-0.500L0-8 8-0.500M-5.500-1.500V7H5.500V-1.500");
  c.fill(new Path2D("M-8-0.500L0-8 8-0.500H5.500V7H-5.500V-0.500Z"));
  c.stroke(house);
}

/** Along a line, which MapLibre draws from left to right. */
function arrow(c: CanvasRenderingContext2D, p: Palette): void {
  const head = new Path2D("M-3-4.500L2.500 0-3 4.500");
  for (const [width, style] of [
    [5, p.halo],
    [2.2, p.warn],
  ] as const) {
    c.lineWidth = width;
    c.strokeStyle = style;
    c.stroke(head);
  }
}
