import { expect, it, test } from "vitest";
import { sampleEvent } from "../../testing/samples";
import { groupEvents } from "./event-groups";
import { FEED_FILTERS, matchesFilter } from "./filter";

const lost = sampleEvent(1, { kind: "vehicle.link_lost", vehicle_id: "v1" });
const ack = sampleEvent(2, {
  kind: "run.ack",
  vehicle_id: "v2",
  run_id: "r2",
  data: { command: "DO_GRIPPER", outcome: "acknowledged", result: "ACCEPTED", progress: null },
});
const stalled = sampleEvent(3, { kind: "service.loop_stalled", data: { delay_s: 0.4 } });
const selected = { vehicle: "v1", run: "r2" };

test("the feed is read in short, of a run, of a vehicle, of drops, for problems, of the service, or whole", () => {
  const groups = groupEvents([stalled, ack, lost]);
  const read = FEED_FILTERS.map((filter) => [
    filter,
    groups.filter((group) => matchesFilter(group, filter, selected)).map(({ head }) => head.seq),
  ]);
  expect(Object.fromEntries(read)).toEqual({
    highlights: [2, 1],
    run: [2],
    vehicle: [1],
    delivery: [2],
    problems: [1],
    service: [3],
    all: [3, 2, 1],
  });
});

test("a hole in the events is never filtered away", () => {
  const [hole] = groupEvents([sampleEvent(3, { kind: "page.missing", data: { first: 1, last: 2 } })]);
  expect(hole && FEED_FILTERS.every((filter) => matchesFilter(hole, filter, selected))).toBe(true);
});

it("a group with a problem in it is found among the problems, however it ended", () => {
  const restored = sampleEvent(4, { kind: "vehicle.link_restored", vehicle_id: "v1" });
  expect(groupEvents([restored, lost]).map((group) => matchesFilter(group, "problems", selected))).toEqual([true]);
});

it("without a selected run or vehicle nothing is of it", () => {
  const [group] = groupEvents([stalled]);
  const none = { vehicle: null, run: null };
  expect(group && (["run", "vehicle"] as const).map((filter) => matchesFilter(group, filter, none))).toEqual([
    false,
    false,
  ]);
});
