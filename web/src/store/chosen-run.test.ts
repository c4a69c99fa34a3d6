import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Run } from "../api/types";
import { sampleRun, sampleVehicle } from "../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const asked: string[] = [];
let answer: (id: string) => Promise<Run>;
vi.doMock("../api/client", () => ({
  api: {
    run: (id: string) => {
      asked.push(id);
      return answer(id);
    },
  },
}));
const { parseProblem } = await import("../api/problem");
const { receiveFrame, runs, status } = await import("./store");
const { runId, selectedRun, selectRun, chooseNoRun, showPanel, vehicleId } = await import("./selection");
const { unknownRun, unknownRunProblem, watchChosenRun } = await import("./chosen-run");
watchChosenRun();

const settled = () => new Promise((done) => setTimeout(done, 0));

/** The stream begins anew, with a run that flies now. */
function connect(): void {
  status.value = { kind: "connecting" };
  const runs = [sampleRun({ id: "flying", vehicle_id: "v2", created_at: 900 })];
  receiveFrame({ type: "snapshot", seq: 0, vehicles: ["v1", "v2"].map((id) => sampleVehicle({ id })), runs });
  status.value = { kind: "live" };
}

describe("a chosen run that the page does not know", () => {
  beforeEach(() => {
    chooseNoRun();
    vehicleId.value = null;
    connect();
    asked.length = 0;
    answer = async (id) => sampleRun({ id, vehicle_id: "v1", state: "completed" });
  });

  it("is read, and no other is shown meanwhile", async () => {
    selectRun("old");
    expect([selectedRun.value, unknownRun.value]).toEqual([null, "old"]);
    await settled();
    expect([selectedRun.value?.id, vehicleId.value, unknownRun.value]).toEqual(["old", "v1", null]);
  });

  it("brings its vehicle from any panel on which it is chosen", async () => {
    for (const name of ["jobs", "plan", "offboard"] as const) {
      vehicleId.value = "v2";
      showPanel(name);
      selectRun(`old, from ${name}`);
      await settled();
      expect([selectedRun.value?.id, vehicleId.value]).toEqual([`old, from ${name}`, "v1"]);
    }
  });

  it("takes nobody away from what they turned to while it was read", async () => {
    vehicleId.value = "v2";
    selectRun("awaited");
    showPanel("offboard");
    await settled();
    expect([vehicleId.value, runs.value["awaited"]?.id]).toEqual(["v2", "awaited"]);
    runId.value = "linked beside a vehicle";
    await settled();
    expect([vehicleId.value, selectedRun.value?.id]).toEqual(["v2", "linked beside a vehicle"]);
    showPanel("run");
  });

  it("stays the chosen one with the next snapshot, without another question", async () => {
    selectRun("older");
    await settled();
    connect();
    expect(selectedRun.value?.id).toBe("older");
    expect(asked).toEqual(["older"]);
  });

  it("that does not exist is told so, and is asked for again with the next connection", async () => {
    answer = async () => {
      throw parseProblem(404, { code: "resource.not_found" });
    };
    selectRun("none");
    await settled();
    expect([selectedRun.value, unknownRunProblem.value?.status]).toEqual([null, 404]);
    connect();
    await settled();
    expect(asked).toEqual(["none", "none"]);
    chooseNoRun();
    expect([selectedRun.value?.id, unknownRunProblem.value]).toEqual(["flying", null]);
  });

  it("is asked for once the page is live, as after a link was opened", async () => {
    status.value = { kind: "connecting" };
    runId.value = "linked";
    expect([asked, selectedRun.value]).toEqual([[], null]);
    connect();
    await settled();
    expect([asked, selectedRun.value]).toMatchObject([["linked"], { id: "linked" }]);
  });
});
