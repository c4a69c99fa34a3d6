import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { selectRun, selectVehicle } from "../../store/selection";
import { receiveFrame, world } from "../../store/store";
import { sampleRun, sampleVehicle } from "../../testing/samples";
import { followable } from "./shown";

describe("what the map can follow", () => {
  beforeEach(() => {
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
    receiveFrame({
      type: "snapshot",
      seq: 0,
      vehicles: ["v1", "v2", "v3"].map((id) => sampleVehicle({ id })),
      runs: [sampleRun({ id: "r1", vehicle_id: "v1" }), sampleRun({ id: "r2", vehicle_id: "v2" })],
    });
    expect(Object.keys(world.value.runs)).toEqual(["r1", "r2"]);
  });
  afterEach(() => vi.unstubAllGlobals());

  it("is the vehicle that flies the chosen run, until another one is chosen", () => {
    selectRun("r1");
    expect(followable.value?.id).toBe("v1");
    selectRun("r2");
    expect(followable.value?.id).toBe("v2");
    selectVehicle("v3");
    expect(followable.value?.id).toBe("v3");
  });
});
