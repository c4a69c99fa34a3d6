import { describe, expect, it } from "vitest";
import type { MapExtent } from "../../store/map-view";
import { degreeLabel, graticule, gridLabels } from "./graticule";

const VIEW: MapExtent = { west: 8.54, south: 47.39, east: 8.56, north: 47.4, width_px: 800, height_px: 600 };

describe("the graticule", () => {
  it("covers the view and a margin, with lines neither crowded nor rare at every zoom", () => {
    for (const span of [1e-4, 1e-3, 0.02, 0.3, 5, 90, 360]) {
      const view = { ...VIEW, west: -span / 2, east: span / 2, south: -span / 3, north: span / 3 };
      const { step_deg, major, minor } = graticule(view);
      const spacing_px = (step_deg / span) * view.width_px;
      expect(spacing_px, `span ${span}`).toBeGreaterThan(40);
      expect(spacing_px, `span ${span}`).toBeLessThan(120);
      expect(major.length + minor.length).toBeLessThan(200);
    }
  });

  it("labels its lines with the decimals of its step", () => {
    expect(degreeLabel(8.545, 0.001, "EW")).toBe("8.545° E");
    expect(degreeLabel(-47.4, 0.01, "NS")).toBe("47.40° S");
    expect(degreeLabel(0, 10, "EW")).toBe("0°");
  });

  it("puts no label into the corners of the map", () => {
    const grid = graticule(VIEW);
    const project = ([lon, lat]: [number, number]) => ({
      x: ((lon - VIEW.west) / 0.02) * 800,
      y: ((VIEW.north - lat) / 0.01) * 600,
    });
    const labels = gridLabels(grid, VIEW, project);
    expect(labels.length).toBeGreaterThan(0);
    for (const { edge, at_px } of labels) {
      expect(at_px).toBeGreaterThan(30);
      expect(at_px).toBeLessThan((edge === "top" ? 800 : 600) - 30);
    }
  });
});
