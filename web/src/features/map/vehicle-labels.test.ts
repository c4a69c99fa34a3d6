import { describe, expect, it } from "vitest";
import { type LabelMetrics, type LabelRect, type LabelRequest, placeLabels } from "./vehicle-labels";

const LOOK: LabelMetrics = { line: 12, away: 20, widthOf: (label) => label.length * 6 };
const at = (label: string, x: number, y = 0, selected = false, stale = false): LabelRequest => ({
  label,
  place: { x, y },
  selected,
  stale,
});
const lines = (...seen: LabelRequest[]) =>
  placeLabels(seen, LOOK).map((block) => block.lines.map(({ label }) => label));
const over = (a: LabelRect, b: LabelRect) =>
  a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

describe("labels of vehicles", () => {
  it("stand below them", () => {
    expect(placeLabels([at("v1", 100, 50)], LOOK)).toEqual([
      { lines: [{ label: "v1", stale: false }], left: 92, right: 108, top: 70, bottom: 82 },
    ]);
  });

  it("are one list on one pad, in the order of the fleet, the chosen one first", () => {
    expect(lines(at("v1", 0), at("v2", 5), at("v3", 10))).toEqual([["v1", "v2", "v3"]]);
    expect(lines(at("v1", 0), at("v3", 10), at("v2", 5, 0, true))).toEqual([["v2", "v1", "v3"]]);
    expect(lines(at("v1", 0), at("v2", 100))).toEqual([["v2"], ["v1"]]);
  });

  it("are grey one by one, as the vehicles on one pad are lost", () => {
    const [block] = placeLabels([at("v1", 0), at("v2 · lost", 5, 0, false, true)], LOOK);
    expect(block?.lines.map(({ stale }) => stale)).toEqual([false, true]);
  });

  it("count the rest of a crowd", () => {
    const crowd = Array.from({ length: 200 }, (_, i) => at(`v${i + 1}`, i / 100));
    expect(lines(...crowd)).toEqual([["v1", "v2", "v3", "+197 more"]]);
    expect(lines(...crowd.slice(0, 4))).toEqual([["v1", "v2", "v3", "v4"]]);
  });

  it("go above or beside a vehicle whose place below is taken", () => {
    const [below, above] = placeLabels([at("v1 · 120 m", 0), at("v2 · 120 m", 30)], LOOK);
    expect([below?.top, above?.bottom]).toEqual([20, -20]);
    expect([below, above].map((block) => block?.lines[0]?.label)).toEqual(["v2 · 120 m", "v1 · 120 m"]);
  });

  it("never lie on each other, and name every vehicle of a sparse sky", () => {
    let seed = 7;
    const next = () => {
      seed = (seed * 16807) % 2147483647;
      return seed / 2147483647;
    };
    const blocks = placeLabels(
      Array.from({ length: 300 }, (_, i) => at(`v${i}`, next() * 900, next() * 500)),
      LOOK,
    );
    for (const [i, one] of blocks.entries()) expect(blocks.some((other, k) => k !== i && over(one, other))).toBe(false);
    const sparse = Array.from({ length: 100 }, (_, i) => at(`v${i}`, (i % 10) * 60, Math.floor(i / 10) * 60));
    expect(placeLabels(sparse, LOOK).length).toBe(100);
  });
});
