import { expect, test } from "vitest";
import type { DropComparison, ItemComparison } from "../../api/types";
import { because } from "../../testing/samples";
import { differenceTone, formatDifference, formatPause, isExplained, needsOwnLine, visitLabel } from "./run-comparison";

function item(fields: Partial<ItemComparison>): ItemComparison {
  return {
    item_id: "door",
    type: "waypoint",
    visit: 1,
    predicted_s: 20,
    flown_s: 22,
    paused_s: 0,
    difference_percent: 10,
    uncertainty_s: 0,
    reason: null,
    ...fields,
  };
}

test("a visit has a name of its own", () => {
  expect(visitLabel(item({}))).toBe("door");
  expect(visitLabel(item({ visit: 2 }))).toBe("door (visit 2)");
});

test("a difference has its sign, and what was called unsure", () => {
  expect(formatDifference(item({}))).toBe("+10 %");
  expect(formatDifference(item({ difference_percent: -7.4, uncertainty_s: 3 }))).toBe("-7 % ± 3 s");
});

test("a pause is named, and that no time counts it", () => {
  expect([formatPause(65.2), formatPause(0.2)]).toEqual(["Paused for 1 min 05 s, not counted.", ""]);
});

test("what was not flown says why", () => {
  expect(
    formatDifference(item({ flown_s: null, difference_percent: null, reason: because("comparison.not_flown_yet") })),
  ).toBe("not flown yet");
  expect(differenceTone(item({ flown_s: null }))).toBe("neutral");
});

test("a sentence needs more room than a column", () => {
  expect(needsOwnLine(item({ flown_s: null, reason: because("comparison.not_flown_yet") }))).toBe(false);
  const why = because("comparison.no_release_sent", {}, because("drop.too_fast", { max_ground_speed_m_s: 0.5 }));
  expect(needsOwnLine(item({ flown_s: null, reason: why }))).toBe(true);
  const drop = { item_id: "door", distance_m: null, reason: why } as DropComparison;
  expect(isExplained(drop, [item({ flown_s: null, reason: why })])).toBe(true);
  expect(isExplained(drop, [item({})])).toBe(false);
  expect(needsOwnLine(item({ reason: because("comparison.visit_not_predicted") }))).toBe(false);
});

test("fifteen percent are promised, and a second for what is shorter", () => {
  expect(differenceTone(item({ flown_s: 23 }))).toBe("ok");
  expect(differenceTone(item({ flown_s: 24 }))).toBe("warn");
  expect(differenceTone(item({ flown_s: 24, uncertainty_s: 2 }))).toBe("ok");
  expect(differenceTone(item({ predicted_s: 1, flown_s: 1.9 }))).toBe("ok");
});
