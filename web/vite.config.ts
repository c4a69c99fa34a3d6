import { defineConfig } from "vitest/config";
import { apiDocs } from "./plugins/api-docs.ts";
import { compressed } from "./plugins/compressed.ts";

const service = process.env["WAYDROP_URL"] ?? "http://127.0.0.1:8080";

export default defineConfig({
  base: "/",
  plugins: [apiDocs("docs-ui"), compressed()],
  build: {
    target: "es2022",
    sourcemap: false,
    assetsInlineLimit: 0, // nothing as data: or inline, so that a strict content security policy holds
    chunkSizeWarningLimit: 1300, // the map library
    rolldownOptions: {
      output: {
        // The map library changes seldom: its own chunk stays in the browser's cache.
        codeSplitting: {
          groups: [
            { name: "maplibre", test: /node_modules[\\/](maplibre-gl|@maplibre|@mapbox)/ },
            { name: "basemaps", test: /node_modules[\\/]@protomaps/ },
          ],
        },
        // MapLibre's worker ends in .mjs, which some servers do not know as JavaScript.
        assetFileNames: (asset) =>
          asset.names.some((name) => name.endsWith(".mjs"))
            ? "assets/[name]-[hash].js"
            : "assets/[name]-[hash][extname]",
      },
    },
  },
  server: { proxy: { "/api": { target: service, ws: true, changeOrigin: true } } },
  test: { include: ["{src,tools}/**/*.test.ts"], environment: "node", setupFiles: "src/testing/setup.ts" },
});
