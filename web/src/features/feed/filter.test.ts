import { expect, it, test } from "vitest";
import { because, type EventFields, sampleDrop, sampleEvent, sampleRun } from "../../testing/samples";
import { FEED_FILTERS, matchesFilter, repeatedSeqs } from "./filter";

const lost = sampleEvent(1, { kind: "vehicle.link_lost", vehicle_id: "v1" });
const ack = sampleEvent(2, {
  kind: "run.ack",
  vehicle_id: "v2",
  data: { command: "DO_GRIPPER", outcome: "acknowledged", result: "ACCEPTED", progress: null },
});
const hole = sampleEvent(3, { kind: "page.missing", data: { first: 1, last: 2 } });

test("the feed is read whole, of one vehicle, of what was done to parcels, or for problems alone", () => {
  const read = FEED_FILTERS.map((choice) =>
    [lost, ack].filter((event) => matchesFilter(event, choice, "v1")).map(({ seq }) => seq),
  );
  expect(read).toEqual([[1, 2], [1, 2], [1], [2], [1]]);
});

test("a hole in the events is never filtered away", () => {
  expect(FEED_FILTERS.every((choice) => matchesFilter(hole, choice, "v1"))).toBe(true);
});

const told = (...events: EventFields[]) =>
  events.map((fields, i) => sampleEvent(i + 1, { run_id: "r1", ...fields })).toReversed();
const changed = (state: "flying" | "at_drop", fields: object = {}): EventFields => ({
  kind: "run.changed",
  data: { ...sampleRun({ state, ...fields }) },
});

it("a run that changed in nothing that is said is quiet, and each new state is news", () => {
  expect([
    ...repeatedSeqs(
      told(changed("flying"), { kind: "run.item" }, changed("flying"), changed("at_drop"), changed("flying")),
    ),
  ]).toEqual([3]);
});

it("a new reason is news", () => {
  expect(
    repeatedSeqs(told(changed("flying"), changed("flying", { reason: because("run.resuming_as_asked") }))).size,
  ).toBe(0);
});

it("runs and drops are told apart", () => {
  expect(repeatedSeqs(told(changed("flying"), { ...changed("flying"), run_id: "r2" })).size).toBe(0);
  const drop = (id: string): EventFields => ({ kind: "run.drop", data: { ...sampleDrop({ plan_item_id: id }) } });
  expect([...repeatedSeqs(told(drop("a"), drop("b"), drop("a")))]).toEqual([3]);
});

it("of an upload the beginning and the end of each list are news", () => {
  const sent = (n: number, list = "mission"): EventFields => ({
    kind: "run.upload_progress",
    data: { mission_type: list, sent: n, total: 4, attempt: 1 },
  });
  expect([...repeatedSeqs(told(sent(1, "fence"), sent(4, "fence"), sent(1), sent(2), sent(3), sent(4)))]).toEqual([
    4, 5,
  ]);
});

it("nothing else is ever quiet", () => {
  expect(
    repeatedSeqs(
      told({ kind: "run.ack" }, { kind: "run.ack" }, { kind: "vehicle.link_lost" }, { kind: "vehicle.link_lost" }),
    ).size,
  ).toBe(0);
});
