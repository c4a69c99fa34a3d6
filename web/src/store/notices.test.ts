import { beforeEach, expect, it } from "vitest";
import { commandVehicle, notices, reportProblem } from "./notices";

const shown = () => notices.value.map(({ action }) => action);

beforeEach(() => (notices.value = []));

it("a command that succeeds takes the notices of its vehicle away, and no others", async () => {
  reportProblem("Return v1", new Error("no answer"), "v1");
  reportProblem("Return v2", new Error("no answer"), "v2");
  reportProblem("Load the jobs", new Error("no answer"));
  await commandVehicle("Hold v1", "v1", async () => undefined);
  expect(shown()).toEqual(["Return v2", "Load the jobs"]);
});

it("a refusal that came after a command was sent stays when that one succeeds", async () => {
  reportProblem("Start v1", new Error("refused"), "v1");
  const refused = () => commandVehicle("Return v1", "v1", () => Promise.reject(new Error("refused")));
  await commandVehicle("Pause v1", "v1", refused);
  expect(shown()).toEqual(["Return v1"]);
});

it("what is tried again and fails again is one notice, and only the newest are kept", () => {
  for (const action of ["a", "b", "a", "c", "d"]) reportProblem(action, new Error("no answer"));
  expect(shown()).toEqual(["a", "c", "d"]);
});

it("no refusal of a command is left out for others", () => {
  for (const id of [1, 2, 3, 4, 5]) reportProblem(`Start v${id}`, new Error("refused"), `v${id}`);
  for (const action of ["a", "b", "c", "d"]) reportProblem(action, new Error("no answer"));
  expect(shown()).toEqual(["Start v1", "Start v2", "Start v3", "Start v4", "Start v5", "b", "c", "d"]);
});
