/** Colours mean one thing: see `Tone`. They are written in two files, one for the style sheets and one for the map. */

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import type { DropOutcome, JobState, RunState, TaskReport, TaskState } from "./api/types";
import { jobStateLabel, jobStateTone } from "./features/jobs/labels";
import { PALETTES } from "./features/map/look";
import { queueStateLabel, queueStateTone } from "./features/tasks/labels";
import { dropLabel, dropTone, runStateLabel, runStateTone, type Tone } from "./format/labels";
import { sampleDrop, sampleJob } from "./testing/samples";

const SOURCE = fileURLToPath(new URL(".", import.meta.url));
const THEMES = { light: ":root", dark: ':root[data-theme="dark"]' } as const;
const TONES = Object.keys({ neutral: 0, info: 0, ok: 0, warn: 0, danger: 0, drop: 0 } satisfies Record<Tone, 0>);

const TOKENS = "ui/tokens.css";
const WITH_COLOURS = [TOKENS, "features/map/look.ts"];
const RAW_COLOUR = /\b(?:rgb|hsl|hwb|lab|lch|oklab|oklch)a?\(|(?:["'`]|:\s*|,\s*)#[0-9a-f]{3,8}\b/i;

function read(path: string): string {
  return readFileSync(join(SOURCE, path), "utf8");
}

/** "--ok" and what else the style sheet sets for a theme. */
function tokens(theme: keyof typeof THEMES): Readonly<Record<string, string>> {
  const start = read(TOKENS).split(`\n${THEMES[theme]} {`)[1] ?? "";
  const [block = ""] = start.split("}");
  return Object.fromEntries([...block.matchAll(/--([\w-]+): (.+);/g)].map(([, name, value]) => [name, value]));
}

test("a colour is written where all colours are, and used by its name", () => {
  const elsewhere = readdirSync(SOURCE, { recursive: true, encoding: "utf8" })
    .filter((path) => /\.(css|tsx?)$/.test(path) && !/\.test\.ts$|schema\.d\.ts$/.test(path))
    .filter((path) => !WITH_COLOURS.includes(path))
    .flatMap((path) =>
      read(path)
        .split("\n")
        .map((line, i) => ({ line, at: `${path}:${i + 1}` })),
    )
    .filter(({ line }) => RAW_COLOUR.test(line));
  expect(elsewhere.map(({ at }) => at)).toEqual([]);
});

test.each(["light", "dark"] as const)("each tone has a colour of its own, on the %s map too", (theme) => {
  const given = tokens(theme);
  expect(new Set(TONES.map((tone) => given[tone])).size).toBe(TONES.length);
  for (const tone of TONES) expect(read(TOKENS)).toContain(`.tone-${tone} {\n  --tone: var(--${tone});`);
  const onMap = Object.entries(PALETTES[theme]).filter(([name]) => TONES.includes(name));
  expect(onMap.length).toBeGreaterThan(0);
  expect(Object.fromEntries(onMap)).toEqual(Object.fromEntries(onMap.map(([name]) => [name, given[name]])));
});

const RUNS: Readonly<Record<RunState, Tone>> = {
  created: "neutral",
  uploading: "info",
  uploaded: "info",
  starting: "info",
  flying: "info",
  at_drop: "drop",
  paused: "warn",
  returning: "warn",
  landed: "ok",
  completed: "ok",
  aborted: "warn",
  failed: "danger",
  lost: "danger",
};
const JOBS: Readonly<Record<JobState, Tone>> = {
  queued: "neutral",
  preparing: "info",
  prepared: "info",
  flying: "info",
  completed: "ok",
  failed: "danger",
  cancelled: "warn",
  expired: "warn",
  returned: "neutral",
};
const DROPS: Readonly<Record<DropOutcome, Tone>> = {
  pending: "neutral",
  released: "ok",
  kept: "warn",
  unknown: "danger",
};
const TASKS: Readonly<Record<TaskState, Tone>> = {
  idle: "neutral",
  waiting: "info",
  standing: "info",
  flying: "info",
  ending: "info",
  paused: "warn",
  manual: "warn",
};

function entries<S extends string>(table: Readonly<Record<S, Tone>>): [S, Tone][] {
  return Object.entries(table) as [S, Tone][];
}

test("a state has the colour of its meaning, and the same word has the same colour in each view", () => {
  const shown = [
    ...entries(RUNS).map(([state, tone]) => ({ tone, word: runStateLabel(state), is: runStateTone(state) })),
    ...entries(JOBS).map(([state, tone]) => {
      const job = sampleJob({ state });
      return { tone, word: jobStateLabel(job), is: jobStateTone(job) };
    }),
    ...entries(DROPS).map(([outcome, tone]) => {
      const drop = sampleDrop({ outcome, certainty: "sensed" });
      return { tone, word: dropLabel(drop), is: dropTone(drop) };
    }),
    ...entries(TASKS).map(([state, tone]) => {
      const report = { state } as TaskReport;
      return { tone, word: queueStateLabel(report), is: queueStateTone(report) };
    }),
  ];
  expect(shown.filter(({ tone, is }) => tone !== is)).toEqual([]);
  const coloured = new Set(shown.map(({ word, is }) => `${word}: ${is}`));
  expect(coloured.size).toBe(new Set(shown.map(({ word }) => word)).size);
});
