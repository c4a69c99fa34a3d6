import { afterEach, describe, expect, it } from "vitest";
import {
  formatAge,
  formatAltitude,
  formatClimbRate,
  formatDistance,
  formatDuration,
  formatHeading,
  formatLinkAge,
  formatMoment,
  formatPercent,
  formatPosition,
  formatSpeed,
  formatWholeAltitude,
  inPageUnits,
  roundDistance,
  unitSystem,
} from "./units";

describe("measurements", () => {
  it("that are not known are a dash, never a zero", () => {
    expect(
      [formatAltitude, formatDistance, formatSpeed, formatClimbRate, formatDuration, formatPercent, formatHeading].map(
        (say) => say(null),
      ),
    ).toEqual(["–", "–", "–", "–", "–", "–", "–"]);
  });

  it("have as many decimals as help", () => {
    expect([0.42, 9, 120.4, 12_300].map(formatDistance)).toEqual(["0.4 m", "9 m", "120 m", "12.3 km"]);
    expect([formatDuration(5), formatDuration(0.5), formatDuration(65), formatDuration(3720)]).toEqual([
      "5 s",
      "0.5 s",
      "1 min 05 s",
      "1 h 02 min",
    ]);
    expect([formatHeading(5), formatHeading(359.8)]).toEqual(["005°", "000°"]);
  });

  it("of age can be read while they grow", () => {
    expect([formatAge(null), formatAge(0.42), formatAge(14.2), formatAge(200), formatAge(9000)]).toEqual([
      "never",
      "0.4 s",
      "14 s",
      "3 min",
      "3 h",
    ]);
  });

  it("of a link's age does not change while heartbeats come", () => {
    expect([formatLinkAge(null), formatLinkAge(0), formatLinkAge(1.9), formatLinkAge(2), formatLinkAge(14.2)]).toEqual([
      "never",
      "< 2 s",
      "< 2 s",
      "2.0 s",
      "14 s",
    ]);
  });
});

describe("the units of the page", () => {
  afterEach(() => (unitSystem.value = "metric"));

  it("are metres, or feet with knots or miles; heights are never in miles", () => {
    const say = () => [
      formatAltitude(3048),
      formatDistance(1000),
      formatDistance(5000),
      formatSpeed(10),
      formatClimbRate(2.54),
    ];
    expect(say()).toEqual(["3048 m", "1000 m", "5000 m", "10.0 m/s", "2.5 m/s"]);
    unitSystem.value = "aviation";
    expect(say()).toEqual(["10\u202f000 ft", "3281 ft", "2.7 NM", "19.4 kn", "500 ft/min"]);
    unitSystem.value = "miles";
    expect(say()).toEqual(["10\u202f000 ft", "3281 ft", "3.1 mi", "22.4 mph", "500 ft/min"]);
  });

  it("say no minus before a zero", () => {
    expect([formatSpeed(-0.04), formatClimbRate(-0.04), formatAltitude(-0.04)]).toEqual(["0.0 m/s", "0.0 m/s", "0 m"]);
    unitSystem.value = "aviation";
    expect([formatClimbRate(-0.01), formatWholeAltitude(-0.1)]).toEqual(["0 ft/min", "0 ft"]);
  });

  it("make round steps of their own for the rings on the map", () => {
    expect([900, 4000, 80].map((view_m) => formatDistance(roundDistance(view_m / 8)))).toEqual([
      "200 m",
      "500 m",
      "10 m",
    ]);
    unitSystem.value = "aviation";
    expect([900, 80, 16_000, 80_000].map((view_m) => formatDistance(roundDistance(view_m / 8)))).toEqual([
      "500 ft",
      "50 ft",
      "2 NM",
      "10 NM",
    ]);
  });

  it("show a place with its latitude first, to a tenth of a metre", () => {
    expect(formatPosition({ latitude_deg: 47.39774249, longitude_deg: -8.5 })).toBe("47.397742, -8.500000");
  });

  it("stand beside a plan's own fields, and only where they differ", () => {
    expect(inPageUnits("m", 30)).toBe("");
    unitSystem.value = "aviation";
    expect([inPageUnits("m", 30), inPageUnits("m/s", 5), inPageUnits("s", 5), inPageUnits("m", undefined)]).toEqual([
      "98 ft",
      "9.7 kn",
      "",
      "",
    ]);
  });
});

it("a duration of days is in days", () => {
  expect([86_399, 86_400, 3 * 86_400 + 7_300].map(formatDuration)).toEqual(["23 h 59 min", "1 d 0 h", "3 d 2 h"]);
});

it("a moment has a date unless it is today", () => {
  const at = new Date(2026, 6, 3, 7, 10, 34);
  const onThe = (day: number, year = 2026) =>
    formatMoment(at.getTime() / 1000, new Date(year, 6, day, 12).toDateString());
  expect([onThe(3), onThe(4), onThe(3, 2027)]).toEqual(["07:10:34", "3 Jul 07:10:34", "3 Jul 2026 07:10:34"]);
});
