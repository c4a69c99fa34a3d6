/**
 * What the service knows of offboard control of a vehicle: what it follows, its limits, and what an entry would find
 * now.
 */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { EntryCheck, FlownBy, OffboardDetail } from "../../api/types";
import { report } from "../../store/notices";
import { panel } from "../../store/selection";
import { live } from "../../store/store";
import { controlledRun, controlledVehicle, manualControl, offboardNow, pace } from "./control-state";
import { speedsOf } from "./setpoint";

const answer = signal<{ readonly vehicle: string; readonly detail: OffboardDetail } | null>(null);
/** Null until it is known for the vehicle that the panel is about. */
export const detail = computed(() =>
  answer.value?.vehicle === controlledVehicle.value?.id ? (answer.value?.detail ?? null) : null,
);
export const speeds = computed(() => speedsOf(pace.value, detail.value?.limits ?? null));

export const entryCheck = signal<EntryCheck | null>(null);
export const checking = signal(false);
/** Somebody says so: an entry then allows a loss action that needs sticks. */
export const sticksHeld = signal(false);

/** Whether the vehicle follows a form of setpoint as it flies now. */
export function follows(form: string): boolean {
  return detail.value?.capabilities.some((row) => row.form === form && row.taken) ?? false;
}

/** Whether it follows what the controls of this page ask for. */
export const followsControls = (): boolean => follows("velocity_body");

/** How its tasks are flown, or would be; null: not at all, or that is not known. */
export const flownBy = computed<FlownBy | null>(() => {
  const own = manualControl.value.phase === "off" ? null : (offboardNow.value?.flown_by ?? null);
  return own ?? detail.value?.tasks.flown_by ?? null;
});

/** It follows no controls and flies tasks: this page commands it and never flies it. */
export const tasksOnly = computed(() =>
  manualControl.value.phase === "off" ? !followsControls() && flownBy.value !== null : manualControl.value.tasksOnly,
);

/** A wing that follows setpoints: at its entry the stream must begin with a task's, for nothing else is said to it. */
export const needsTask = computed(
  () => tasksOnly.value && flownBy.value === "setpoints" && (manualControl.value.tasks?.tasks.length ?? 0) === 0,
);

/** As text: what a vehicle follows changes with what it flies as, and with nothing else. */
const detailKey = computed(() => {
  const vehicle = controlledVehicle.value;
  return panel.value === "offboard" && live.value && vehicle !== null
    ? [vehicle.id, vehicle.vehicle_type, vehicle.firmware, vehicle.state.vtol_state].join("\n")
    : "";
});

/** What a check depends on: asked anew when it changes. */
const checkKey = computed(() => {
  if (manualControl.value.phase !== "leased" || controlledVehicle.value === null) return "";
  const { id, state } = controlledVehicle.value;
  const run = controlledRun.value;
  return JSON.stringify([
    id,
    run?.id,
    run?.state,
    state.armed,
    state.connected,
    state.mode,
    state.vtol_state,
    sticksHeld.value,
  ]);
});

/** Whose lease this page has: what somebody says of the sticks is said of one vehicle, for one lease. */
const leaseOf = computed(() => (manualControl.value.phase === "off" ? null : manualControl.value.vehicle));

export function watchOffboardFacts(): void {
  effect(() => {
    void leaseOf.value;
    sticksHeld.value = false;
  });
  effect(() => {
    const key = detailKey.value;
    if (key !== "") void readDetail(key);
  });
  effect(() => {
    if (checkKey.value === "") forgetCheck();
    else void checkEntry();
  });
}

async function readDetail(key: string): Promise<void> {
  const vehicle = key.split("\n")[0] ?? "";
  try {
    const detail = await api.offboard(vehicle);
    if (key === detailKey.peek()) answer.value = { vehicle, detail };
  } catch (error) {
    report(`Read what ${vehicle} follows`, error);
  }
}

/** What keeps a vehicle from being taken may be over soon: nobody has to ask for it. */
const CHECK_AGAIN_MS = 5_000;
let questions = 0;

function forgetCheck(): void {
  questions += 1;
  entryCheck.value = null;
  checking.value = false;
}

/** Asks what an entry would find now. The newest answer counts. */
export async function checkEntry(): Promise<void> {
  const vehicle = manualControl.peek().vehicle;
  if (vehicle === null) return;
  const mine = ++questions;
  checking.value = true;
  try {
    const found = await api.entryCheck(vehicle, sticksHeld.peek());
    if (mine === questions) entryCheck.value = found;
  } catch (error) {
    if (mine !== questions) return;
    entryCheck.value = null;
    report(`Check ${vehicle} before an entry`, error);
  } finally {
    if (mine === questions) {
      checking.value = false;
      if (entryCheck.value?.ready !== true) setTimeout(() => mine === questions && void checkEntry(), CHECK_AGAIN_MS);
    }
  }
}
