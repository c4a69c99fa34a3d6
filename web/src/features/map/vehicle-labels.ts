/**
 * Where the vehicles' labels go on the screen: none over another, and one list for vehicles that stand on one place.
 * Pure.
 */

import type { ScreenPoint } from "./vehicle-marks";

export interface LabelRect {
  readonly left: number;
  readonly top: number;
  readonly right: number;
  readonly bottom: number;
}

export interface LabelRequest {
  readonly place: ScreenPoint;
  readonly label: string;
  readonly selected: boolean;
  readonly stale: boolean;
}

/** Sizes in pixels of the screen. */
export interface LabelMetrics {
  readonly line: number;
  /**
   * From the middle of a vehicle to its label. Vehicles nearer to each other have one list: their icons are one heap.
   */
  readonly away: number;
  widthOf(label: string): number;
}

/** One vehicle of a list, or the number of the rest. */
type LabelLine = Pick<LabelRequest, "label" | "stale">;

interface LabelBlock extends LabelRect {
  readonly lines: readonly LabelLine[];
}

/** The rest is counted. */
const MOST_LINES = 4;
const PADDING_PX = 2;

/**
 * The later ones are on top: their labels are placed first. One without room anywhere around its vehicle is left out.
 */
export function placeLabels(seen: readonly LabelRequest[], look: LabelMetrics): LabelBlock[] {
  const room = new Room();
  return groupsOf(seen, look.away).flatMap(({ place, lines }) => {
    const half = Math.max(...lines.map(({ label }) => look.widthOf(label))) / 2 + PADDING_PX;
    const high = lines.length * look.line;
    const box = around(place, half, high, look.away).find((one) => room.take(one));
    return box === undefined ? [] : [{ ...box, lines }];
  });
}

interface Group {
  readonly place: ScreenPoint;
  readonly lines: readonly LabelLine[];
}

/** Each with the place of its topmost vehicle. The chosen vehicle leads its list, the others follow in their order. */
function groupsOf(seen: readonly LabelRequest[], within_px: number): Group[] {
  const groups: LabelRequest[][] = [];
  for (const one of seen.toReversed()) {
    const near = groups.find(
      ([top]) => top !== undefined && Math.hypot(top.place.x - one.place.x, top.place.y - one.place.y) < within_px,
    );
    if (near === undefined) groups.push([one]);
    else near.push(one);
  }
  return groups.flatMap((members) =>
    members[0] === undefined ? [] : [{ place: members[0].place, lines: linesOf(members) }],
  );
}

function linesOf(members: readonly LabelRequest[]): LabelLine[] {
  const [top, ...others] = members;
  const inOrder = top?.selected === true ? [top, ...others.reverse()] : members.toReversed();
  const lines = inOrder.map(({ label, stale }) => ({ label, stale }));
  return lines.length <= MOST_LINES
    ? lines
    : [...lines.slice(0, MOST_LINES - 1), { label: `+${lines.length - MOST_LINES + 1} more`, stale: false }];
}

/** Below, above, right, left. */
function around({ x, y }: ScreenPoint, half: number, high: number, away: number): LabelRect[] {
  const box = (left: number, top: number): LabelRect => ({ left, top, right: left + 2 * half, bottom: top + high });
  return [
    box(x - half, y + away),
    box(x - half, y - away - high),
    box(x + away, y - high / 2),
    box(x - away - 2 * half, y - high / 2),
  ];
}

/** Side of the squares in which boxes are looked for. */
const SQUARE_PX = 64;

/** What is taken of the screen. */
class Room {
  readonly #squares = new Map<string, LabelRect[]>();

  /** True if there was room, which is taken now. */
  take(box: LabelRect): boolean {
    const near = squaresOf(box);
    if (near.some((square) => this.#squares.get(square)?.some((other) => overlap(box, other)))) return false;
    for (const square of near) {
      const kept = this.#squares.get(square);
      if (kept === undefined) this.#squares.set(square, [box]);
      else kept.push(box);
    }
    return true;
  }
}

function squaresOf({ left, top, right, bottom }: LabelRect): string[] {
  const names: string[] = [];
  for (let x = Math.floor(left / SQUARE_PX); x <= Math.floor(right / SQUARE_PX); x++) {
    for (let y = Math.floor(top / SQUARE_PX); y <= Math.floor(bottom / SQUARE_PX); y++) names.push(`${x} ${y}`);
  }
  return names;
}

function overlap(a: LabelRect, b: LabelRect): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
