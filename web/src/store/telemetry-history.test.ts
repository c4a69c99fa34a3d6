import { describe, expect, it } from "vitest";
import { sampleState } from "../testing/samples";
import { MAX_SAMPLES, stripPath, TelemetryHistory } from "./telemetry-history";

describe("telemetry strips", () => {
  it("keep one sample a second for some minutes, whatever the telemetry's rate", () => {
    const strips = new TelemetryHistory();
    const told = Array.from({ length: 4000 }, (_, i) =>
      strips.add({ v1: sampleState({ relative_altitude_m: i }) }, i / 10),
    );
    expect(told.filter(Boolean)).toHaveLength(400);
    expect([strips.of("v1").length, strips.of("v1").at(-1)?.time, strips.of("v2")]).toEqual([MAX_SAMPLES, 399, []]);
  });

  it("say nothing of a vehicle whose link is lost, and break where it was silent", () => {
    const strips = new TelemetryHistory();
    const at = (time: number, connected = true) =>
      strips.add({ v1: sampleState({ connected, relative_altitude_m: time }) }, time);
    for (const time of [0, 1, 2]) at(time);
    expect(at(3, false)).toBe(false);
    for (const time of [30, 31]) at(time);
    const drawn = stripPath(strips.of("v1"), (sample) => sample.relative_altitude_m, 60, 10, 1);
    expect(drawn?.path.match(/M/g)).toHaveLength(2);
    expect([drawn?.low, drawn?.high]).toEqual([0, 31]);
  });

  it("begin anew where the service's clock is set back, and show what is now", () => {
    const strips = new TelemetryHistory();
    for (const time of [700, 701, 100, 101])
      strips.add({ v1: sampleState({ relative_altitude_m: time < 200 ? 5 : 30 }) }, time);
    expect(strips.of("v1").map(({ relative_altitude_m }) => relative_altitude_m)).toEqual([5, 5]);
  });

  it("draw no line from what is not known", () => {
    const strips = new TelemetryHistory();
    strips.add({ v1: sampleState({ battery_percent: null }) }, 0);
    strips.add({ v1: sampleState({ battery_percent: 80, velocity_north_m_s: 3, velocity_east_m_s: -4 }) }, 1);
    expect(stripPath(strips.of("v1"), (sample) => sample.battery_percent, 60, 10, 1)).toBeNull();
    expect(strips.of("v1").at(-1)?.ground_speed_m_s).toBe(5);
  });
});
