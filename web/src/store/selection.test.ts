import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Run } from "../api/types";
import { sampleRun, sampleVehicle } from "../testing/samples";
import { MOST_ENDED } from "./world";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { dispatch, receiveFrame } = await import("./store");
const { chooseNoRun, selectedRun, selectRun, selectVehicle, vehicleId } = await import("./selection");

describe("the run that is shown while none is chosen", () => {
  beforeEach(() => {
    chooseNoRun();
    vehicleId.value = null;
    const runs = [
      sampleRun({ id: "ended", vehicle_id: "v8", state: "completed", created_at: 800 }),
      sampleRun({ id: "flying", vehicle_id: "v2", created_at: 900 }),
    ];
    receiveFrame({ type: "snapshot", seq: 0, vehicles: [sampleVehicle({ id: "v2" })], runs });
  });

  it("is the newest one if no vehicle is chosen either", () => expect(selectedRun.value?.id).toBe("flying"));

  it("stays that vehicle's, whatever others do: no other's commands come under a finger", () => {
    expect(selectedRun.value?.id).toBe("flying");
    for (const state of ["uploaded", "failed"] as const) {
      const newer = sampleRun({ id: "newer", vehicle_id: "v1", state, created_at: 950, updated_at: 951 });
      dispatch({ type: "run_read", run: newer });
      expect(selectedRun.value?.id).toBe("flying");
    }
    const fields = { vehicle_id: "v2", updated_at: 999 };
    dispatch({ type: "run_read", run: sampleRun({ id: "flying", state: "completed", created_at: 900, ...fields }) });
    dispatch({ type: "run_read", run: sampleRun({ id: "other", vehicle_id: "v3", created_at: 960 }) });
    expect(selectedRun.value?.id).toBe("flying");
    dispatch({ type: "run_read", run: sampleRun({ id: "next", created_at: 950, ...fields }) });
    expect(selectedRun.value?.id).toBe("next");
  });

  it("is the newest one again when the operator asks for it in the place of an unknown run", () => {
    expect(selectedRun.value?.id).toBe("flying");
    dispatch({ type: "run_read", run: sampleRun({ id: "newer", vehicle_id: "v1", created_at: 950 }) });
    selectRun("unknown");
    expect(selectedRun.value).toBeNull();
    chooseNoRun();
    expect(selectedRun.value?.id).toBe("newer");
  });

  it("is none of another vehicle after the page has forgotten that vehicle's runs", async () => {
    vi.resetModules();
    const [store, selection] = [await import("./store"), await import("./selection")];
    const read = (id: string, run: Partial<Run>) => {
      store.dispatch({ type: "run_read", run: sampleRun({ id, ...run }) });
      return selection.selectedRun.value;
    };
    expect(read("landed", { vehicle_id: "v2", state: "completed" })?.id).toBe("landed");
    read("flying", { vehicle_id: "v1" });
    for (let n = 1; n < MOST_ENDED; n++) read(`r${n}`, { vehicle_id: "v3", state: "completed" });
    expect(selection.selectedRun.value?.id).toBe("landed");
    expect(read("one more", { vehicle_id: "v3", state: "completed" })).toBeNull();
  });

  it("is an open one where there is one", async () => {
    vi.resetModules();
    const [store, selection] = [await import("./store"), await import("./selection")];
    const runs = [
      sampleRun({ id: "flying", vehicle_id: "v2", created_at: 900 }),
      sampleRun({ id: "failed", vehicle_id: "v1", state: "failed", created_at: 950 }),
    ];
    store.receiveFrame({ type: "snapshot", seq: 0, vehicles: [], runs });
    expect(selection.selectedRun.value?.id).toBe("flying");
  });

  it("is never that of another vehicle, known to the page or not", () => {
    selectVehicle("v9");
    expect(selectedRun.value).toBeNull();
  });

  it("is the chosen vehicle's own, even if the vehicle is not in the list", () => {
    selectVehicle("v8");
    expect(selectedRun.value?.id).toBe("ended");
  });
});
