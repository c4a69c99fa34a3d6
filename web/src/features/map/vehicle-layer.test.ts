import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { sampleState, sampleVehicle } from "../../testing/samples";
import type { MapLook } from "./look";
import { VehicleLayer } from "./vehicle-layer";
import { vehicleMarks } from "./vehicle-marks";

vi.mock("./icons", () => ({ drawIcon: () => null }));

/** Draws nothing, and takes every call. */
const context: unknown = new Proxy({}, { get: () => () => ({ width: 10 }), set: () => true });
const canvas = {
  getContext: () => context,
  clientWidth: 800,
  clientHeight: 600,
  width: 0,
  height: 0,
} as unknown as HTMLCanvasElement;
const camera = {
  project: ([x, y]: readonly [number, number]) => ({ x: x * 100, y: y * 100 }),
  getCenter: () => ({ lng: 0 }),
  getPixelRatio: () => 1,
};
const at = (longitude_deg: number) => sampleState({ latitude_deg: 1, longitude_deg });
const fleet = {
  v1: sampleVehicle({ id: "v1", state: at(1) }),
  v2: sampleVehicle({ id: "v2", state: at(2) }),
  v3: sampleVehicle({ id: "v3", state: at(3) }),
};

describe("the layer of vehicles", () => {
  let frame: () => void = () => undefined;
  beforeEach(() => {
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => {
      frame = draw;
      return 1;
    });
    vi.stubGlobal("cancelAnimationFrame", () => undefined);
  });
  afterEach(() => vi.unstubAllGlobals());

  it("means the vehicle that is seen under the pointer, also while a newer order waits to be drawn", () => {
    const layer = new VehicleLayer(canvas, camera, { palette: {}, scale: 1 } as MapLook);
    const under = () => [100, 200, 300].map((x) => layer.at({ x, y: 100 }));
    layer.setMarks(vehicleMarks(fleet, null, true));
    frame();
    expect(under()).toEqual(["v1", "v2", "v3"]);
    layer.setMarks(vehicleMarks(fleet, "v1", true)); // the chosen one lies on top: last
    expect(under()).toEqual(["v1", "v2", "v3"]);
    frame();
    expect(under()).toEqual(["v1", "v2", "v3"]);
  });
});
