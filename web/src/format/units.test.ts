import { afterEach, describe, expect, it } from "vitest";
import {
  age,
  altitude,
  besides,
  climbRate,
  distance,
  heading,
  linkAge,
  percent,
  roundDistance,
  seconds,
  speed,
  systemName,
  wholeAltitude,
} from "./units";

describe("measurements", () => {
  it("that are not known are a dash, never a zero", () => {
    expect([altitude, distance, speed, climbRate, seconds, percent, heading].map((say) => say(null))).toEqual([
      "–",
      "–",
      "–",
      "–",
      "–",
      "–",
      "–",
    ]);
  });

  it("have as many decimals as help", () => {
    expect([0.42, 9, 120.4, 12_300].map(distance)).toEqual(["0.4 m", "9 m", "120 m", "12.3 km"]);
    expect([seconds(5), seconds(0.5), seconds(65), seconds(3720)]).toEqual([
      "5 s",
      "0.5 s",
      "1 min 05 s",
      "1 h 02 min",
    ]);
    expect([heading(5), heading(359.8)]).toEqual(["005°", "000°"]);
  });

  it("of age can be read while they grow", () => {
    expect([age(null), age(0.42), age(14.2), age(200), age(9000)]).toEqual(["never", "0.4 s", "14 s", "3 min", "3 h"]);
  });

  it("of a link's age does not change while heartbeats come", () => {
    expect([linkAge(null), linkAge(0), linkAge(1.9), linkAge(2), linkAge(14.2)]).toEqual([
      "never",
      "< 2 s",
      "< 2 s",
      "2.0 s",
      "14 s",
    ]);
  });
});

describe("the units of the page", () => {
  afterEach(() => (systemName.value = "metric"));

  it("are metres, or feet with knots or miles; heights are never in miles", () => {
    const say = () => [altitude(3048), distance(1000), distance(5000), speed(10), climbRate(2.54)];
    expect(say()).toEqual(["3048 m", "1000 m", "5000 m", "10.0 m/s", "2.5 m/s"]);
    systemName.value = "aviation";
    expect(say()).toEqual(["10\u202f000 ft", "3281 ft", "2.7 NM", "19.4 kn", "500 ft/min"]);
    systemName.value = "miles";
    expect(say()).toEqual(["10\u202f000 ft", "3281 ft", "3.1 mi", "22.4 mph", "500 ft/min"]);
  });

  it("say no minus before a zero", () => {
    expect([speed(-0.04), climbRate(-0.04), altitude(-0.04)]).toEqual(["0.0 m/s", "0.0 m/s", "0 m"]);
    systemName.value = "aviation";
    expect([climbRate(-0.01), wholeAltitude(-0.1)]).toEqual(["0 ft/min", "0 ft"]);
  });

  it("make round steps of their own for the rings on the map", () => {
    expect([900, 4000, 80].map((view_m) => distance(roundDistance(view_m / 8)))).toEqual(["200 m", "500 m", "10 m"]);
    systemName.value = "aviation";
    expect([900, 80, 16_000, 80_000].map((view_m) => distance(roundDistance(view_m / 8)))).toEqual([
      "500 ft",
      "50 ft",
      "2 NM",
      "10 NM",
    ]);
  });

  it("stand beside a plan's own fields, and only where they differ", () => {
    expect(besides("m", 30)).toBe("");
    systemName.value = "aviation";
    expect([besides("m", 30), besides("m/s", 5), besides("s", 5), besides("m", undefined)]).toEqual([
      "98 ft",
      "9.7 kn",
      "",
      "",
    ]);
  });
});
