import { expect, it } from "vitest";
import { sampleDrop, sampleRun } from "../../testing/samples";
import { type PlanItemView, viewPlan } from "../plan/document";
import { skippedDrops, skipTargets } from "./run-skip";

const PLAN = viewPlan({
  items: [
    { id: "up", type: "takeoff" },
    { id: "bridge", type: "waypoint" },
    { id: "clinic", type: "waypoint" },
    { id: "drop", type: "gripper", alternate: { id: "yard" } },
    { id: "slow", type: "change_speed" },
    { id: "home", type: "return_to_launch" },
  ],
});
const ids = (fields: Parameters<typeof sampleRun>[0]) => skipTargets(PLAN, sampleRun(fields)).map(({ id }) => id);
const target = (id: string) => PLAN.items.find((item) => item.id === id) as PlanItemView;

it("a run can skip to the stops behind the item that is flown now", () => {
  expect(ids({ item_id: "bridge" })).toEqual(["clinic", "drop", "home"]);
  expect(ids({ item_id: "clinic", state: "paused" })).toEqual(["drop", "home"]);
});

it("at the other place of a drop it is that drop's item which is flown", () => {
  expect(ids({ item_id: "yard" })).toEqual(["home"]);
});

it("nothing is offered near the ground, at a drop, before the item is known, or while a change is under way", () => {
  expect(ids({ item_id: "up" })).toEqual([]);
  expect(ids({ item_id: "home" })).toEqual([]);
  expect(ids({ item_id: null })).toEqual([]);
  for (const state of ["at_drop", "uploaded", "returning", "completed"] as const)
    expect(ids({ item_id: "bridge", state })).toEqual([]);
});

it("a drop whose parcel is gone, or of which nobody knows, is no place to skip to; a kept one is", () => {
  for (const outcome of ["released", "unknown"] as const) {
    expect(ids({ item_id: "bridge", drops: [sampleDrop({ outcome })] })).toEqual(["clinic", "home"]);
  }
  expect(ids({ item_id: "bridge", drops: [sampleDrop({ outcome: "kept" })] })).toContain("drop");
});

it("open drops that are passed over are named", () => {
  const run = sampleRun({ item_id: "bridge" });
  expect(skippedDrops(PLAN, run, target("home"))).toEqual(["drop"]);
  expect(skippedDrops(PLAN, run, target("drop"))).toEqual([]);
  expect(
    skippedDrops(PLAN, sampleRun({ item_id: "bridge", drops: [sampleDrop({ outcome: "released" })] }), target("home")),
  ).toEqual([]);
});
