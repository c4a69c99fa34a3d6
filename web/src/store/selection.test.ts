import { beforeEach, describe, expect, it, vi } from "vitest";
import { sampleRun, sampleVehicle } from "../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { receiveFrame } = await import("./store");
const { chooseNoRun, selectedRun, selectVehicle, vehicleId } = await import("./selection");

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

  it("is never that of another vehicle, known to the page or not", () => {
    selectVehicle("v9");
    expect(selectedRun.value).toBeNull();
  });

  it("is the chosen vehicle's own, even if the vehicle is not in the list", () => {
    selectVehicle("v8");
    expect(selectedRun.value?.id).toBe("ended");
  });
});
