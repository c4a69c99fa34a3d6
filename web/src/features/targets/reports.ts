/** What moving targets report, asked for once a second while somebody wants it: reports are no events. */

import { effect, type ReadonlySignal, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { Target } from "../../api/types";
import { live } from "../../store/store";
import { type Seen, seenAs } from "./targets";

const EVERY_MS = 1000;

export interface Reports {
  readonly targets: Readonly<Record<string, Target>>;
  /** When they were read: the page's clock. */
  readonly at: number;
}

/** Null while nobody wants them. */
export const reports = signal<Reports | null>(null);

/** `after_s`: so long after they were read. */
export function seenIn({ targets }: Reports, feed: string, after_s: number): Seen {
  return seenAs(targets[feed] ?? null, after_s);
}

export function watchTargetReports(wanted: ReadonlySignal<boolean>): void {
  effect(() => {
    if (!wanted.value || !live.value) {
      reports.value = null;
      return undefined;
    }
    void read(wanted);
    const timer = setInterval(() => {
      if (!document.hidden) void read(wanted);
    }, EVERY_MS);
    return () => clearInterval(timer);
  });
}

let asked = 0;

/** The newest answer wins. One that fails changes nothing: what is shown says how old it is. */
async function read(wanted: ReadonlySignal<boolean>): Promise<void> {
  const mine = ++asked;
  const targets = await api.targets().catch(() => null);
  if (targets !== null && mine === asked && wanted.peek())
    reports.value = {
      targets: Object.fromEntries(targets.map((target) => [target.feed, target])),
      at: performance.now(),
    };
}
