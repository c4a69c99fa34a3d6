/**
 * What each folder may import, and how long lines and files may be. Circles of files are refused by Biome
 * (noImportCycles).
 */

import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";
import { preProcessFile } from "typescript";
import { describe, expect, it } from "vitest";

const SOURCE = fileURLToPath(new URL(".", import.meta.url));

/** Folders that features share, each with those it may import. None imports a feature. */
const SHARED: Readonly<Record<string, readonly string[]>> = {
  api: [],
  geo: ["api"],
  format: ["api"],
  store: ["api", "format", "geo"],
  ui: ["api", "format"],
  testing: ["api"],
};

/** Features, each with those it may import. */
const FEATURES: Readonly<Record<string, readonly string[]>> = {
  fleet: [],
  plan: [],
  jobs: ["plan"],
  simulator: [],
  targets: ["plan"],
  run: ["plan", "targets"],
  offboard: ["fleet", "run"],
  tasks: ["offboard", "plan", "targets"],
  feed: ["tasks"],
  map: ["fleet", "offboard", "plan", "run", "targets", "tasks"],
  tour: ["plan", "simulator"],
};

const MOST_LINES = 500;
const MOST_CHARACTERS = 120;

interface Source {
  readonly path: string;
  readonly text: string;
  readonly imports: readonly string[];
}

const SOURCES: readonly Source[] = readdirSync(SOURCE, { recursive: true, encoding: "utf8" })
  .filter((path) => /\.tsx?$/.test(path) && !path.endsWith("schema.d.ts"))
  .map((path) => {
    const text = readFileSync(join(SOURCE, path), "utf8");
    const named = preProcessFile(text).importedFiles.map(({ fileName }) => fileName);
    return { path, text, imports: named.filter((name) => name.startsWith(".")).map((name) => target(path, name)) };
  });

function target(from: string, name: string): string {
  return normalize(join(dirname(from), name));
}

/** "api", "features/run"; null for the app shell, which sees everything. */
function folderOf(path: string): string | null {
  const [first = "", second = ""] = path.split("/");
  if (first === "features") return `features/${second}`;
  return first === "app" || !path.includes("/") ? null : first;
}

function mayImport(from: string, to: string): boolean {
  const [, feature] = from.split("/");
  const [, imported] = to.split("/");
  if (feature === undefined) return to === "testing" || (SHARED[from]?.includes(to) ?? false);
  return imported === undefined ? to in SHARED : (FEATURES[feature]?.includes(imported) ?? false);
}

/** Folders of a graph that reach themselves. */
function circles(graph: Readonly<Record<string, readonly string[]>>): string[] {
  const reaches = (from: string, to: string, seen: ReadonlySet<string>): boolean =>
    (graph[from] ?? []).some((next) => next === to || (!seen.has(next) && reaches(next, to, new Set([...seen, next]))));
  return Object.keys(graph).filter((name) => reaches(name, name, new Set()));
}

describe("the page's sources", () => {
  it("are in the folders that are listed here", () => {
    const folders = new Set(SOURCES.map(({ path }) => folderOf(path)).filter((folder) => folder !== null));
    expect([...folders].sort()).toEqual(
      [...Object.keys(SHARED), ...Object.keys(FEATURES).map((name) => `features/${name}`)].sort(),
    );
  });

  it("import only what their folder may", () => {
    const wrong = SOURCES.flatMap(({ path, imports }) => {
      const from = folderOf(path);
      if (from === null) return [];
      return imports
        .filter((file) => folderOf(file) !== from)
        .filter((file) => !mayImport(from, folderOf(file) ?? "app"))
        .map((file) => `${path} imports ${file}`);
    });
    expect(wrong).toEqual([]);
  });

  it("use every import that is allowed between features", () => {
    const used = new Set(
      SOURCES.flatMap(({ path, imports }) => imports.map((file) => `${folderOf(path)} ${folderOf(file)}`)),
    );
    const unused = Object.entries(FEATURES).flatMap(([from, list]) =>
      list.map((to) => `features/${from} features/${to}`).filter((edge) => !used.has(edge)),
    );
    expect(unused).toEqual([]);
  });

  it("have no circle of folders", () => {
    expect([circles(SHARED), circles(FEATURES)]).toEqual([[], []]);
  });

  it("have lines and files of a readable length", () => {
    const long = SOURCES.flatMap(({ path, text }) => {
      const lines = text.split("\n");
      const wide = lines.flatMap((line, i) =>
        isTooWide(line) ? [`${path}:${i + 1} has ${line.length} characters`] : [],
      );
      return lines.length > MOST_LINES ? [...wide, `${path} has ${lines.length} lines`] : wide;
    });
    expect(long).toEqual([]);
  });
});

/** A single string cannot be broken: paths of icons, sentences. */
function isTooWide(line: string): boolean {
  return line.length > MOST_CHARACTERS && !/^\s*(\w+: |(const )?\w+ = |[?:] )?["`].*["`][,;]?$/.test(line);
}
