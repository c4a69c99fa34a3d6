import "maplibre-gl/dist/maplibre-gl.css";
import { Map, setWorkerUrl } from "maplibre-gl";
import workerUrl from "maplibre-gl/dist/maplibre-gl-worker.mjs?url";

setWorkerUrl(workerUrl);
const el = document.getElementById("app")!;
el.style.height = "100vh";
const lines = [];
for (let i = -10; i <= 10; i++) {
  lines.push([[8.54 + i * 0.002, 47.3], [8.54 + i * 0.002, 47.5]], [[8.4, 47.4 + i * 0.002], [8.7, 47.4 + i * 0.002]]);
}
const map = new Map({
  container: el,
  center: [8.54, 47.4],
  zoom: 14,
  style: {
    version: 8,
    sources: { g: { type: "geojson", data: { type: "MultiLineString", coordinates: lines } }, p: { type: "geojson", data: { type: "Point", coordinates: [8.54, 47.4] } } },
    layers: [
      { id: "bg", type: "background", paint: { "background-color": "#0d141c" } },
      { id: "g", type: "line", source: "g", paint: { "line-color": "#2b3a4b" } },
      { id: "t", type: "symbol", source: "p", layout: { "text-field": "v1 · clinic é", "text-size": 20, "text-font": ["sans-serif"] }, paint: { "text-color": "#fff" } },
    ],
  },
});
map.on("idle", () => (document.title = "idle"));
