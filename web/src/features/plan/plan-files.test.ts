import { expect, it } from "vitest";
import { fileStem, foreignFormat, nameFromFile } from "./plan-files";

it("files of QGroundControl and Mission Planner are told by their content", () => {
  expect(foreignFormat('{"fileType": "Plan", "mission": {}}')).toBe("qgc");
  expect(foreignFormat('\uFEFF {"fileType": "GeoFence"}')).toBe("qgc"); // the service says what it is
  expect(foreignFormat("QGC WPL 110\n0\t1\t0")).toBe("waypoints");
});

it("Waydrop's own plans, and what is no document at all, are opened as they are", () => {
  for (const text of ['{"version": 1, "items": []}', '{"version": 1,', "", "hello", "[1]"])
    expect(foreignFormat(text)).toBeNull();
});

it("a plan whose file says no name is called as the file", () => {
  expect(nameFromFile("Field 3.waypoints")).toBe("Field 3");
  expect(nameFromFile(".plan")).toBe("Plan");
});

it("a plan's name becomes a file's name", () => {
  expect(fileStem("Clinic run: Nord!")).toBe("clinic-run-nord");
  expect(fileStem("…")).toBe("plan");
});
