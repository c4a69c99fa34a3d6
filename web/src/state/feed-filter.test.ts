import { expect, test } from "vitest";
import { sampleEvent } from "../testing/samples";
import { FEEDS, isWanted } from "./feed-filter";

const lost = sampleEvent(1, { kind: "vehicle.link_lost", vehicle_id: "v1" });
const ack = sampleEvent(2, { kind: "run.ack", vehicle_id: "v2", data: { command: "DO_GRIPPER", outcome: "acknowledged", result: "ACCEPTED", progress: null } });
const hole = sampleEvent(3, { kind: "page.missing", data: { first: 1, last: 2 } });

test("the feed is read whole, of one vehicle, of what was done to parcels, or for problems alone", () => {
  const read = FEEDS.map((choice) => [lost, ack].filter((event) => isWanted(event, choice, "v1")).map(({ seq }) => seq));
  expect(read).toEqual([[1, 2], [1, 2], [1], [2], [1]]);
});

test("a hole in the events is never filtered away", () => {
  expect(FEEDS.every((choice) => isWanted(hole, choice, "v1"))).toBe(true);
});
