import { expect, it, vi } from "vitest";
import { sampleRun, sampleState, sampleVehicle } from "../testing/samples";
import { isHeard, linkLossOf, unheardRuns } from "./link-loss";
import { receiveFrame } from "./store";

const measured = { measuredAt: 5_000, serviceAhead_s: 1_000 };
const vehicle = (fields: object) => sampleVehicle({ state: sampleState(fields) });

it("a vehicle is lost since its last heartbeat, by the service's clock", () => {
  const lost = vehicle({ connected: false, heartbeat_age_s: 4 });
  expect(linkLossOf(lost, measured, 1_005)).toEqual({ heardAt: 1_001, age_s: 4 });
  expect(linkLossOf(lost, measured, 1_011.5)).toEqual({ heardAt: 1_001, age_s: 10.5 });
});

it("a vehicle that is heard is not lost, and one that never was heard is lost for an unknown time", () => {
  expect(linkLossOf(vehicle({ connected: true, heartbeat_age_s: 2.9 }), measured, 1_005)).toBeNull();
  const unknown = { heardAt: null, age_s: null };
  expect(linkLossOf(undefined, measured, 1_005)).toEqual(unknown); // a run has it, and the service started again
  expect(linkLossOf(vehicle({ connected: false, heartbeat_age_s: null }), measured, 1_005)).toEqual(unknown);
  const before = { measuredAt: null, serviceAhead_s: null };
  expect(linkLossOf(vehicle({ connected: false }), before, null)).toEqual(unknown);
});

it("a vehicle that is not in the list is not heard, and its open run is told", () => {
  vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
  const runs = [
    sampleRun({ id: "newer", vehicle_id: "v9", created_at: 300 }),
    sampleRun({ id: "older", vehicle_id: "v8", created_at: 200 }),
    sampleRun({ id: "ended", vehicle_id: "v7", state: "completed" }),
    sampleRun({ id: "heard", vehicle_id: "v1" }),
  ];
  receiveFrame({ type: "snapshot", seq: 0, vehicles: [sampleVehicle()], runs });
  expect(["v1", "v9"].map(isHeard)).toEqual([true, false]);
  expect(unheardRuns.value.map(({ id }) => id)).toEqual(["older", "newer"]);
  vi.unstubAllGlobals();
});
