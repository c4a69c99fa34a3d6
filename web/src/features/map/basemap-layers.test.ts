import type { StyleSpecification } from "maplibre-gl";
import { afterEach, expect, test, vi } from "vitest";
import { isOfBasemap, layersOfStyle, loadBasemap, WORLD_ONLY } from "./basemap-layers";
import type { MapSettings } from "./basemaps";
import { FONT } from "./look";

const STYLE: StyleSpecification = {
  version: 8,
  sprite: "sprites/light",
  glyphs: "https://glyphs.example/{fontstack}/{range}.pbf",
  sources: { streets: { type: "vector", tiles: ["/t/{z}/{x}/{y}"] }, terrain: { type: "vector", url: "/t.json" } },
  layers: [
    { id: "background", type: "background" },
    {
      id: "places",
      type: "symbol",
      source: "streets",
      "source-layer": "places",
      layout: {
        "text-font": ["Noto Sans Regular"],
        "text-field": ["format", ["get", "pgf:name"], { "text-font": ["literal", ["Noto Sans Devanagari"]] }],
      },
    },
  ],
};
const OWN_FONT = ["literal", FONT];
const MAPS: MapSettings = {
  tiles: { url: "/tiles/{z}/{x}/{y}", attribution: "", zooms: [3, 15], vector: true },
  styles: { light: "https://maps.example/light.json", dark: "https://maps.example/dark.json" },
  satellite: { url: "https://sky.example/{z}/{x}/{y}.jpg", attribution: "Sky" },
};

afterEach(() => vi.unstubAllGlobals());

test("another style's layers and sources have ids of their own, and its addresses are those of its server", () => {
  const { sources, layers, sprite } = layersOfStyle(STYLE, "https://maps.example/styles/light.json");
  expect(layers.map(({ id }) => id)).toEqual(["base:background", "base:places"]);
  expect(layers[1]).toMatchObject({ source: "base:streets", "source-layer": "places" });
  expect(sources["base:streets"]).toMatchObject({ tiles: ["https://maps.example/t/{z}/{x}/{y}"] });
  expect(sources["base:terrain"]).toMatchObject({ url: "https://maps.example/t.json" });
  expect(sprite).toBe("https://maps.example/styles/sprites/light");
  expect(Object.keys(sources).every(isOfBasemap)).toBe(true);
});

test("texts are drawn with the page's own typeface, so that no glyph server is asked", () => {
  const layout = layersOfStyle(STYLE, "https://maps.example/").layers[1]?.layout;
  expect(layout).toEqual({
    "text-font": OWN_FONT,
    "text-field": ["format", ["get", "name"], { "text-font": OWN_FONT }],
  });
});

test("vector tiles of the service are drawn in the page's own style, without icons from outside", async () => {
  vi.stubGlobal("location", { origin: "http://desk", href: "http://desk/" });
  const { sources, layers, sprite, whole } = await loadBasemap("tiles", MAPS, "light");
  expect(Object.values(sources)).toMatchObject([
    { type: "vector", tiles: ["http://desk/tiles/{z}/{x}/{y}"], minzoom: 3, maxzoom: 15 },
  ]);
  expect(sources["base:tiles"]).toHaveProperty("attribution", expect.stringContaining("OpenStreetMap"));
  expect(layers.length).toBeGreaterThan(50);
  expect([sprite, whole]).toEqual([undefined, false]); // around its area the coarse world is seen
});

test("satellite pictures come from the address of the setting, and without one the coarse world is shown", async () => {
  const { sources, whole } = await loadBasemap("satellite", MAPS, "light");
  expect(Object.values(sources)).toEqual([
    {
      type: "raster",
      tileSize: 256,
      tiles: ["https://sky.example/{z}/{x}/{y}.jpg"],
      attribution: "Sky",
      minzoom: 0,
      maxzoom: 19,
    },
  ]);
  expect(whole).toBe(false);
  expect(await loadBasemap("satellite", { ...MAPS, satellite: null }, "light")).toBe(WORLD_ONLY);
});

test("pictures are dimmed in the dark", async () => {
  const paint = async (mode: "light" | "dark") => (await loadBasemap("satellite", MAPS, mode)).layers[0]?.paint;
  expect(await paint("dark")).toHaveProperty("raster-brightness-max");
  expect(await paint("light")).not.toHaveProperty("raster-brightness-max");
});

test("a style that its server does not give is an error", async () => {
  vi.stubGlobal("fetch", async () => new Response("", { status: 503 }));
  await expect(loadBasemap("streets", MAPS, "dark")).rejects.toThrow("503");
});
