import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { selectRun, selectVehicle } from "../../store/selection";
import { receiveFrame, world } from "../../store/store";
import { sampleRun, sampleState, sampleVehicle } from "../../testing/samples";
import { followable, shownHome } from "./shown";

const HOME = { latitude_deg: 47.4, longitude_deg: 8.55, altitude_m: 488 };

describe("what the map can follow", () => {
  beforeEach(() => {
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
    receiveFrame({
      type: "snapshot",
      seq: 0,
      vehicles: ["v1", "v2", "v3"].map((id) => sampleVehicle({ id, state: sampleState({ home: HOME }) })),
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

  it("is no other vehicle, and no other vehicle's home is shown, while the chosen one is not known", () => {
    selectVehicle("v9");
    expect([followable.value, shownHome.value]).toEqual([null, null]);
  });
});
