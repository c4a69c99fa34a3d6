import { expect, test } from "vitest";
import { readTiles, tileLayers, tileSources } from "./tiles";

const meta = (facts: Record<string, string>) => (name: string) => facts[name] ?? null;

test("without tiles the map asks nobody for anything", () => {
  const none = readTiles(meta({}), "http://desk");
  expect([none, tileSources(none), tileLayers(none, "dark")]).toEqual([null, {}, []]);
});

test("tiles of the service itself come from the page's own origin, with the zooms that its file has", () => {
  const tiles = readTiles(
    meta({ "waydrop-tiles": "/tiles/{z}/{x}/{y}", "waydrop-tiles-zooms": "3 15" }),
    "http://desk",
  );
  expect(tileSources(tiles)["tiles"]).toEqual({
    type: "raster",
    tiles: ["http://desk/tiles/{z}/{x}/{y}"],
    tileSize: 256,
    minzoom: 3,
    maxzoom: 15,
  });
});

test("tiles of a server are asked for as they are named, and their makers are told", () => {
  const tiles = readTiles(
    meta({ "waydrop-tiles": "https://tiles.example/{z}/{x}/{y}.png", "waydrop-tiles-by": "Map makers" }),
    "http://desk",
  );
  expect(tiles).toMatchObject({ url: "https://tiles.example/{z}/{x}/{y}.png", by: "Map makers", zooms: [0, 19] });
  expect(tileLayers(tiles, "light")).toHaveLength(1);
});
