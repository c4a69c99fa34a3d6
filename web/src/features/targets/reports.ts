/** Reports of moving targets, polled once a second while they are shown: reports are not events. */

import { effect, type ReadonlySignal, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { Target } from "../../api/types";
import { live } from "../../store/store";
import { sightingAfter, type TargetSighting } from "./targets";

const EVERY_MS = 1000;

interface TargetReports {
  readonly targets: Readonly<Record<string, Target>>;
  /** When they were read: the page's clock. */
  readonly at: number;
}

/** Null while none are shown. */
export const targetReports = signal<TargetReports | null>(null);

/** `after_s`: so long after they were read. */
export function sightingIn({ targets }: TargetReports, feed: string, after_s: number): TargetSighting {
  return sightingAfter(targets[feed] ?? null, after_s);
}

export function watchTargetReports(wanted: ReadonlySignal<boolean>): void {
  effect(() => {
    if (!wanted.value || !live.value) {
      targetReports.value = null;
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
    targetReports.value = {
      targets: Object.fromEntries(targets.map((target) => [target.feed, target])),
      at: performance.now(),
    };
}
