import { describe, expect, it } from "vitest";
import { CALM, parseWind, speedText } from "./wind";

describe("a typed wind", () => {
  it("is calm where nothing is typed", () => {
    expect(parseWind(CALM)).toEqual({ wind: null });
    expect(parseWind({ ...CALM, from: " " })).toEqual({ wind: null });
  });

  it("is in m/s, whatever the units it was typed in", () => {
    expect(parseWind({ from: "270", speed: "5,5", units: "metric" })).toEqual({
      wind: { from_deg: 270, speed_m_s: 5.5 },
    });
    expect(parseWind({ from: "0", speed: "10", units: "aviation" })).toEqual({
      wind: { from_deg: 0, speed_m_s: expect.closeTo(5.144, 3) as number },
    });
  });

  it("needs both, within the service's bounds", () => {
    for (const from of ["", "-1", "361", "west"])
      expect(parseWind({ from, speed: "5", units: "metric" })).toHaveProperty(
        "error",
        expect.stringContaining("0 to 360"),
      );
    for (const speed of ["", "-1", "75.1", "x"])
      expect(parseWind({ from: "9", speed, units: "metric" })).toHaveProperty(
        "error",
        expect.stringContaining("0 to 75 m/s"),
      );
    expect(parseWind({ from: "9", speed: "150", units: "aviation" })).toHaveProperty(
      "error",
      expect.stringContaining("0 to 145 kn"),
    );
  });

  it("stays the same wind when the units are switched", () => {
    const typed = { from: "270", speed: "5", units: "metric" as const };
    expect(speedText(typed, "metric")).toBe("5");
    expect(speedText(typed, "aviation")).toBe("9.7");
    expect(speedText({ ...typed, speed: "?" }, "aviation")).toBe("?");
  });
});
