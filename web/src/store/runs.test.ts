import { expect, it } from "vitest";
import { sampleRun, sampleVehicle } from "../testing/samples";
import { currentRun, flightDuration, newestRuns } from "./runs";

it("a vehicle's current run is the one that the service names", () => {
  const runs = { r1: sampleRun({ id: "r1", created_at: 1 }), r2: sampleRun({ id: "r2", created_at: 2 }) };
  expect(currentRun(sampleVehicle({ run_id: "r1" }), runs)?.id).toBe("r1");
});

it("else it is the newest open one of that vehicle, and none if all are over", () => {
  const runs = {
    r1: sampleRun({ id: "r1", created_at: 1 }),
    r2: sampleRun({ id: "r2", created_at: 2, state: "completed" }),
    r3: sampleRun({ id: "r3", created_at: 3, vehicle_id: "v2" }),
  };
  expect(currentRun(sampleVehicle(), runs)?.id).toBe("r1");
  expect(currentRun(sampleVehicle(), { r2: runs.r2 })).toBeNull();
});

it("runs are listed newest first", () => {
  expect(
    newestRuns({ a: sampleRun({ id: "a", created_at: 1 }), b: sampleRun({ id: "b", created_at: 2 }) }).map(
      ({ id }) => id,
    ),
  ).toEqual(["b", "a"]);
});

it("a flight lasts until it has ended, by the service's clock and not by the last change of the run", () => {
  const run = sampleRun({ started_at: 100, updated_at: 110 });
  expect(flightDuration(run, 400)).toBe(300);
  expect(flightDuration(run, null)).toBe(10);
  expect(flightDuration({ ...run, ended_at: 150 }, 400)).toBe(50);
  expect(flightDuration(sampleRun(), 400)).toBeNull();
});
