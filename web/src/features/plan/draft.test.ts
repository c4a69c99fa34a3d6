import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { sampleEvent, sampleRun, sampleVehicle } from "../../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, 16));
vi.stubGlobal("cancelAnimationFrame", (handle: ReturnType<typeof setTimeout>) => clearTimeout(handle));
const checkPlan = vi.fn(async () => ({ findings: [], timeline: null, parameters_age_s: 40 }));
const createRun = vi.fn();
const api = {
  checkPlan,
  createRun,
  createPlan: async () => ({ id: "p1", name: "Plan" }),
  plans: async () => ({ plans: [], next: null }),
};
vi.doMock("../../api/client", () => ({ api }));
const { now } = await import("../../store/clock");
const { dispatch, receiveFrame, runs, status } = await import("../../store/store");
const { panel, runId, selectVehicle, showPanel, vehicleId } = await import("../../store/selection");
const { canStartTogether, commonStart } = await import("../../store/common-start");
const { openDraft } = await import("./draft-text");
const { planCheck, uploadDraft, watchDraft } = await import("./draft");

/** The checks that were asked for, once the page has waited for further changes. */
async function checks(): Promise<number> {
  await vi.advanceTimersByTimeAsync(1_000);
  return checkPlan.mock.calls.length;
}

describe("the check of a plan", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("is repeated with each change of the chosen vehicle's parameters, and says when they were read", async () => {
    now.value = performance.now(); // the imports took their time
    receiveFrame({ type: "hello", gateway: "gw1", first_seq: 1, seq: 0, server_time: 9_000 });
    const vehicles = ["v1", "v2"].map((id) => sampleVehicle({ id }));
    receiveFrame({ type: "snapshot", seq: 0, vehicles, runs: [] });
    status.value = { kind: "live" };
    watchDraft();
    selectVehicle("v1");
    openDraft("{}");
    const counts = [await checks()];
    for (const [seq, vehicle_id] of [
      [1, "v1"],
      [2, "v1"],
      [3, "v2"],
    ] as const) {
      receiveFrame({ type: "event", event: sampleEvent(seq, { kind: "vehicle.parameters", vehicle_id }) });
      counts.push(await checks());
    }
    expect(counts).toEqual([1, 2, 3, 3]);
    expect(planCheck.value).toMatchObject({ kind: "done", parametersReadAt: expect.closeTo(8_960, -1) });
  });
});

describe("an upload", () => {
  const upload = async (meanwhile: () => void) => {
    openDraft("{}");
    selectVehicle("v1");
    showPanel("plan");
    createRun.mockImplementationOnce(async () => {
      meanwhile();
      return sampleRun({ id: "r1", vehicle_id: "v1", state: "uploading" });
    });
    await uploadDraft("v1");
    expect(runs.value["r1"]?.state).toBe("uploading");
    return [vehicleId.value, runId.value, panel.value];
  };

  it("shows its run", async () => expect(await upload(() => undefined)).toEqual(["v1", "r1", "run"]));

  it("that is answered late takes nobody away from manual control", async () => {
    const shown = await upload(() => {
      showPanel("offboard");
      selectVehicle("v2");
    });
    expect(shown).toEqual(["v2", null, "offboard"]);
  });

  it("is included in a common start, as none is that was prepared elsewhere", async () => {
    await upload(() => undefined);
    for (const [id, vehicle_id] of [
      ["r1", "v1"],
      ["r2", "v2"],
    ] as const)
      dispatch({ type: "run_read", run: sampleRun({ id, vehicle_id, state: "uploaded", updated_at: 999 }) });
    expect([canStartTogether.value, commonStart.value.map(({ id }) => id)]).toEqual([true, ["r1"]]);
  });
});
