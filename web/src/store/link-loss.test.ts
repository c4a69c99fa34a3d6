import { expect, it } from "vitest";
import { sampleState, sampleVehicle } from "../testing/samples";
import { linkLossOf } from "./link-loss";

const measured = { measuredAt: 5_000, serviceAhead_s: 1_000 };
const vehicle = (fields: object) => sampleVehicle({ state: sampleState(fields) });

it("a vehicle is lost since its last heartbeat, by the service's clock", () => {
  const lost = vehicle({ connected: false, heartbeat_age_s: 4 });
  expect(linkLossOf(lost, measured, 1_005)).toEqual({ heardAt: 1_001, age_s: 4 });
  expect(linkLossOf(lost, measured, 1_011.5)).toEqual({ heardAt: 1_001, age_s: 10.5 });
});

it("a vehicle that is heard is not lost, and one that never was heard is lost for an unknown time", () => {
  expect(linkLossOf(vehicle({ connected: true, heartbeat_age_s: 2.9 }), measured, 1_005)).toBeNull();
  expect(linkLossOf(undefined, measured, 1_005)).toBeNull();
  const unknown = { heardAt: null, age_s: null };
  expect(linkLossOf(vehicle({ connected: false, heartbeat_age_s: null }), measured, 1_005)).toEqual(unknown);
  const before = { measuredAt: null, serviceAhead_s: null };
  expect(linkLossOf(vehicle({ connected: false }), before, null)).toEqual(unknown);
});
