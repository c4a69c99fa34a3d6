import { afterEach, expect, it, vi } from "vitest";
import type { RunState } from "../../api/types";
import { pilotNote, principal } from "../../store/principal";
import { sampleRun } from "../../testing/samples";
import { allowedActions, command, mayAct } from "./run-actions";

let sent: string[] = [];

/** A service that refuses each command to a run with this code. */
function refusing(code: string): void {
  sent = [];
  vi.stubGlobal("fetch", async (url: string) => {
    sent.push(url.replace("/api/v1", ""));
    return url.includes("/runs/") ? Response.json({ code }, { status: 409 }) : Response.json({ accepted: true });
  });
}

afterEach(() => vi.unstubAllGlobals());

it("what a run that is not followed does not take is commanded to its vehicle", async () => {
  refusing("run.not_followed");
  const run = sampleRun({ state: "flying" });
  for (const action of ["pause", "return", "land"] as const) await command(run, action);
  const [id, vehicle] = [run.id, run.vehicle_id];
  expect(sent.filter((url) => url.startsWith("/vehicles"))).toEqual(
    ["hold", "return", "land"].map((action) => `/vehicles/${vehicle}/${action}`),
  );
  await expect(command(run, "resume")).rejects.toThrow();
  expect(sent.at(-1)).toBe(`/runs/${id}/resume`);
});

it("what a run refuses for another reason is commanded to nobody else", async () => {
  refusing("run.wrong_state");
  await expect(command(sampleRun({ state: "flying" }), "return")).rejects.toThrow();
  expect(sent).toHaveLength(1);
});

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

it("a vehicle that returns, or lands, can be held where it is or brought back", () => {
  expect(allowedActions(sampleRun({ state: "returning" }))).toEqual(["pause", "return", "land"]);
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

it.each([
  [["viewer"], [false, false]],
  [
    ["viewer", "dispatcher"],
    [true, false],
  ],
  [
    ["viewer", "dispatcher", "pilot"],
    [true, true],
  ],
] as const)("%s may start and return: %s", (roles, wanted) => {
  principal.value = { name: "desk", role: roles.at(-1) ?? "viewer", roles: [...roles] };
  expect([mayAct("start"), mayAct("return")]).toEqual(wanted);
  expect(pilotNote() === null).toBe(roles.length === 3);
  principal.value = null;
});
