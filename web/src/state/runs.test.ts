import { expect, it } from "vitest";
import type { RunState } from "../api/types";
import { sampleRun, sampleVehicle } from "../testing/samples";
import { allowedActions, currentRun, newestRuns } from "./runs";

it("a run that is over offers nothing", () => {
  for (const state of ["completed", "aborted", "failed", "lost"] as const) expect(allowedActions(sampleRun({ state }))).toEqual([]);
});

it("while it starts a run can be aborted, which disarms the vehicle or brings it back", () => {
  expect(allowedActions(sampleRun({ state: "starting" }))).toEqual(["abort"]);
});

it("in every state of flight the vehicle can be told to land", () => {
  const flight: RunState[] = ["flying", "at_drop", "paused", "returning"];
  for (const state of flight) expect(allowedActions(sampleRun({ state }))).toContain("land");
});

it("in flight the vehicle can be told to go to a rally point where the plan has some, and it does not return already", () => {
  for (const state of ["flying", "at_drop", "paused"] as const) expect(allowedActions(sampleRun({ state }), 1)).toContain("rally");
  expect(allowedActions(sampleRun({ state: "flying" }), 0)).not.toContain("rally");
  for (const state of ["uploaded", "starting", "returning", "landed"] as const) expect(allowedActions(sampleRun({ state }), 1)).not.toContain("rally");
});

it("only an uploaded run can be started", () => {
  const states: RunState[] = ["created", "uploading", "uploaded", "starting", "flying", "paused"];
  expect(states.filter((state) => allowedActions(sampleRun({ state })).includes("start"))).toEqual(["uploaded"]);
});

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
  expect(newestRuns({ a: sampleRun({ id: "a", created_at: 1 }), b: sampleRun({ id: "b", created_at: 2 }) }).map(({ id }) => id)).toEqual(["b", "a"]);
});
