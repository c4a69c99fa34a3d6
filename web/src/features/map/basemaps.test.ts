import { expect, test } from "vitest";
import { availableBasemaps, basemapFor, type MapSettings, readMapSettings, serverOf } from "./basemaps";

const TILES = { url: "/tiles/{z}/{x}/{y}", attribution: "", zooms: [3, 15] as const, vector: true };
const STYLES = { light: "https://maps.example/light.json", dark: "https://maps.example/dark.json" };
const SETTINGS: MapSettings = { tiles: TILES, styles: STYLES, satellite: null };

test("without maps in the page only the coarse world is available, and nobody is asked for anything", () => {
  const none = readMapSettings(null);
  expect([availableBasemaps(none), basemapFor(none, null), basemapFor(none, "streets")]).toEqual([
    ["world"],
    "world",
    "world",
  ]);
});

test("the operator's own tiles are shown until somebody chooses, a map over the internet never by itself", () => {
  expect(basemapFor(SETTINGS, null)).toBe("tiles");
  expect(basemapFor(SETTINGS, "world")).toBe("world");
  expect(basemapFor({ ...SETTINGS, tiles: null }, null)).toBe("world");
  expect(basemapFor(SETTINGS, "streets")).toBe("streets");
});

test("a choice that is no longer configured is as none", () => {
  expect(basemapFor({ ...SETTINGS, styles: null }, "streets")).toBe("tiles");
});

test("the server of a map is named before it is asked", () => {
  expect([serverOf("streets", SETTINGS), serverOf("tiles", SETTINGS)]).toEqual(["maps.example", ""]);
});

test("satellite pictures are offered once their address is set, and shown once somebody chooses them", () => {
  const satellite = { url: "https://sky.example/{z}/{x}/{y}.jpg", attribution: "Sky" };
  expect(availableBasemaps(SETTINGS)).not.toContain("satellite");
  const given = readMapSettings(JSON.stringify({ ...SETTINGS, satellite }));
  expect(availableBasemaps(given)).toContain("satellite");
  expect([basemapFor(given, null), basemapFor(given, "satellite")]).toEqual(["tiles", "satellite"]);
  expect(serverOf("satellite", given)).toBe("sky.example");
});
