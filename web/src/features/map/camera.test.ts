import { describe, expect, it } from "vitest";
import { metresBetween } from "../../geo/geometry";
import { boundsAround } from "./camera";

describe("bounds", () => {
  it("of one parked vehicle leave room around it, and of nothing there are none", () => {
    const bounds = boundsAround([[8, 47]]);
    expect(bounds && metresBetween([bounds[0], 47], [bounds[2], 47])).toBeGreaterThan(40);
    expect(boundsAround([])).toBeNull();
  });
});
