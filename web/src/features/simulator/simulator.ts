/**
 * The simulated vehicles, if there are any: read when the page connects, and again and again while they are looked at,
 * or while the simulator behind the service gives no answer.
 */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import { type ProblemError, toProblem } from "../../api/problem";
import type { SimulatorView } from "../../api/types";
import { panel } from "../../store/selection";
import { live } from "../../store/store";

const EVERY_MS = 1000;
/** It may only be busy, or be started later than the service. */
const SILENT_EVERY_MS = 5000;

export const simulator = signal<SimulatorView | null>(null);
/** Whether the page shows the panel: while there are simulated vehicles, or while it is open. */
export const hasSimulator = computed(() => simulator.value?.available === true || panel.value === "simulator");
/** Why the last fault was not set, by its name, or the speed; gone when it is tried again. */
export const faultProblems = signal<Readonly<Record<string, ProblemError>>>({});
export const settingFault = signal<string | null>(null);

/** The service has a simulator, which gave no answer. */
const isSilent = computed(() => simulator.value?.configured === true && !simulator.value.available);

export function watchSimulator(): void {
  effect(() => {
    if (!live.value) return undefined;
    void read();
    return panel.value === "simulator" ? readEvery(EVERY_MS) : undefined;
  });
  effect(() => (live.value && isSilent.value && panel.value !== "simulator" ? readEvery(SILENT_EVERY_MS) : undefined));
}

/** Returns what ends it. */
function readEvery(ms: number): () => void {
  const timer = setInterval(() => {
    if (!document.hidden) void read();
  }, ms);
  return () => clearInterval(timer);
}

/** `vehicle` null: all of them. */
export function setFault(vehicle: string | null, fault: string, value: unknown): Promise<void> {
  return change(fault, () => api.setFault(vehicle, fault, value));
}

/** The name under which a refused speed is kept beside the faults. */
export const SPEED = "speed";

export function setSpeed(speed: number): Promise<void> {
  return change(SPEED, () => api.setSpeed(speed));
}

async function change(what: string, send: () => Promise<unknown>): Promise<void> {
  settingFault.value = what;
  dismissFaultProblem(what);
  try {
    await send();
  } catch (error) {
    faultProblems.value = { ...faultProblems.value, [what]: toProblem(error) };
  } finally {
    settingFault.value = null;
  }
  await read();
}

export function dismissFaultProblem(fault: string): void {
  const { [fault]: _, ...others } = faultProblems.value;
  faultProblems.value = others;
}

let asked = 0;

/** The newest answer wins. One that fails changes nothing: the header says that there is no connection. */
async function read(): Promise<void> {
  const mine = ++asked;
  const view = await api.simulator().catch(() => null);
  if (view !== null && mine === asked) simulator.value = view;
}
