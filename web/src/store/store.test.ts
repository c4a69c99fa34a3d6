import { effect } from "@preact/signals";
import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { StreamFrame } from "../api/types";
import { sampleEvent, sampleState, sampleVehicle } from "../testing/samples";

const hello: StreamFrame = { type: "hello", gateway: "gw1", first_seq: 1, seq: 0, server_time: 0 };
const snapshot: StreamFrame = {
  type: "snapshot",
  seq: 0,
  vehicles: [sampleVehicle({ id: "v10" }), sampleVehicle({ id: "v2" })],
  runs: [],
};
const event = (seq: number): StreamFrame => ({
  type: "event",
  event: sampleEvent(seq, { kind: "vehicle.changed", vehicle_id: "v2", data: { battery_percent: seq } }),
});
const telemetry = (time: number): StreamFrame => ({
  type: "telemetry",
  time,
  recording: true,
  vehicles: { v10: sampleState({ latitude_deg: 47 + time / 1000, relative_altitude_m: time }) },
});

describe("the store", () => {
  let draw: (() => void)[] = [];
  let store: typeof import("./store");
  beforeEach(async () => {
    draw = [];
    vi.useFakeTimers();
    vi.stubGlobal("requestAnimationFrame", (one: () => void) => draw.push(one));
    vi.stubGlobal("cancelAnimationFrame", () => undefined);
    vi.resetModules();
    store = await import("./store");
    store.receiveFrame(hello);
    store.receiveFrame(snapshot);
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  it("shows the fleet with the snapshot, before anybody hears that the stream is live", () => {
    expect(store.vehicleIds.value).toEqual(["v2", "v10"]);
  });

  it("takes in every frame at once and shows them all with the screen's next frame", () => {
    let shown = -1;
    effect(() => {
      void store.world.value;
      shown += 1;
    });
    for (let i = 1; i <= 50; i++) {
      store.receiveFrame(event(i));
      store.receiveFrame(telemetry(i));
      expect(store.lastSeq()).toBe(i); // what the next connection asks for
    }
    expect([shown, store.feed.value.length]).toEqual([0, 0]);
    draw[0]?.();
    expect([shown, store.feed.value.map(({ seq }) => seq)]).toEqual([1, Array.from({ length: 50 }, (_, i) => 50 - i)]);
    expect([
      store.vehicles.value["v2"]?.state.battery_percent,
      store.vehicles.value["v10"]?.state.relative_altitude_m,
    ]).toEqual([50, 50]);
    expect(store.tracks.value["v10"]?.length).toBe(50);
  });

  it("asks for a hole in the events at once", () => {
    store.receiveFrame(event(1));
    expect([store.receiveFrame(event(3)), store.lastSeq()]).toEqual([true, 1]);
  });

  it("shows the answer to what somebody did at once, with all that came before it", () => {
    store.receiveFrame(event(1));
    store.dispatch({ type: "vehicles_read", vehicles: [sampleVehicle({ id: "v7" })] });
    expect([store.feed.value.length, store.vehicleIds.value]).toEqual([1, ["v7"]]);
  });
});
