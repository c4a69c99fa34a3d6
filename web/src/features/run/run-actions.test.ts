import { expect, it } from "vitest";
import type { RunState } from "../../api/types";
import { sampleRun } from "../../testing/samples";
import { allowedActions } from "./run-actions";

it("a run that is over offers nothing", () => {
  for (const state of ["completed", "aborted", "failed", "lost"] as const)
    expect(allowedActions(sampleRun({ state }))).toEqual([]);
});

it("while it starts a run can be aborted, which disarms the vehicle or brings it back", () => {
  expect(allowedActions(sampleRun({ state: "starting" }))).toEqual(["abort"]);
});

it("in every state of flight the vehicle can be told to land", () => {
  const flight: RunState[] = ["flying", "at_drop", "paused", "returning"];
  for (const state of flight) expect(allowedActions(sampleRun({ state }))).toContain("land");
});

it("in flight the vehicle can divert to a rally point where the plan has some, unless it returns already", () => {
  for (const state of ["flying", "at_drop", "paused"] as const)
    expect(allowedActions(sampleRun({ state }), 1)).toContain("divert");
  expect(allowedActions(sampleRun({ state: "flying" }), 0)).not.toContain("divert");
  for (const state of ["uploaded", "starting", "returning", "landed"] as const)
    expect(allowedActions(sampleRun({ state }), 1)).not.toContain("divert");
});

it("only an uploaded run can be started", () => {
  const states: RunState[] = ["created", "uploading", "uploaded", "starting", "flying", "paused"];
  expect(states.filter((state) => allowedActions(sampleRun({ state })).includes("start"))).toEqual(["uploaded"]);
});
