import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { constants, gzipSync } from "node:zlib";
import type { Plugin } from "vite";

/** What shrinks: fonts and pictures do not. */
const SHRINKS = /\.(js|css|json)$/;

/** A .gz beside each script and style sheet: the service sends it to a browser that takes it, and compresses nothing itself. */
export function compressed(): Plugin {
  return {
    name: "waydrop-compressed",
    apply: "build",
    writeBundle({ dir }, bundle) {
      if (dir === undefined) throw new Error("the build has no folder");
      for (const name of Object.keys(bundle).filter((one) => SHRINKS.test(one))) {
        const path = join(dir, name);
        writeFileSync(`${path}.gz`, gzipSync(readFileSync(path), { level: constants.Z_BEST_COMPRESSION }));
      }
    },
  };
}
