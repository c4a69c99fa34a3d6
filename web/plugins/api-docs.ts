import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import type { Plugin } from "vite";

/** Copies Swagger UI and our own initializer into dist/docs, so the API documentation needs no CDN and no inline script. */
export function apiDocs(folder: string): Plugin {
  const swagger = dirname(createRequire(import.meta.url).resolve("swagger-ui-dist/package.json"));
  const files: ReadonlyArray<readonly [from: string, name: string]> = [
    [join(swagger, "swagger-ui-bundle.js"), "swagger-ui-bundle.js"],
    [join(swagger, "swagger-ui.css"), "swagger-ui.css"],
    [join(swagger, "LICENSE"), "swagger-ui-LICENSE.txt"],
    [join(swagger, "NOTICE"), "swagger-ui-NOTICE.txt"],
    [join(folder, "index.html"), "index.html"],
    [join(folder, "docs.css"), "docs.css"],
    [join(folder, "docs.js"), "docs.js"],
  ];
  return {
    name: "waydrop-api-docs",
    apply: "build",
    generateBundle() {
      for (const [from, name] of files) {
        const source = readFileSync(from);
        this.emitFile({ type: "asset", fileName: `docs/${name}`, source });
      }
    },
  };
}
