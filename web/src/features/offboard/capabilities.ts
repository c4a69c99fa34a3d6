/**
 * What the service knows of offboard control of a vehicle: what it follows, its limits, and what an entry would find
 * now.
 */

import { computed, effect, signal } from "@preact/signals";
import { api } from "../../api/client";
import type { ControlMethodName, EntryCheck, OffboardDetail } from "../../api/types";
import { reportProblem } from "../../store/notices";
import { panel } from "../../store/selection";
import { live } from "../../store/store";
import { controlledRun, controlledVehicle, manualControl, offboardState, speedPreset } from "./control-state";
import { presetSpeeds } from "./setpoint";

const answer = signal<{ readonly vehicle: string; readonly detail: OffboardDetail } | null>(null);
/** Null until it is known for the vehicle that the panel is about. */
export const offboardDetail = computed(() =>
  answer.value?.vehicle === controlledVehicle.value?.id ? (answer.value?.detail ?? null) : null,
);
export const maxSpeeds = computed(() => presetSpeeds(speedPreset.value, offboardDetail.value?.limits ?? null));

export const entryCheck = signal<EntryCheck | null>(null);
export const checkingEntry = signal(false);
/** The pilot confirmed it: an entry then allows a loss action that needs sticks. */
export const sticksHeld = signal(false);

/** Whether the vehicle follows a form of setpoint as it flies now. */
export function acceptsSetpoint(form: string): boolean {
  return offboardDetail.value?.capabilities.some((row) => row.form === form && row.accepted) ?? false;
}

/** Whether it follows what the controls of this page ask for. */
export const acceptsControls = (): boolean => acceptsSetpoint("velocity_body");

/** How its tasks are flown, or would be; null: not at all, or that is not known. */
export const controlMethod = computed<ControlMethodName | null>(() => {
  const own = manualControl.value.phase === "off" ? null : (offboardState.value?.control_method ?? null);
  return own ?? offboardDetail.value?.tasks.control_method ?? null;
});

/** It follows no controls and flies tasks: this page commands it and never flies it. */
export const tasksOnly = computed(() =>
  manualControl.value.phase === "off"
    ? !acceptsControls() && controlMethod.value !== null
    : manualControl.value.tasksOnly,
);

/** A wing that follows setpoints: at its entry the stream must begin with a task's, for nothing else is said to it. */
export const needsTask = computed(
  () => tasksOnly.value && controlMethod.value === "setpoints" && (manualControl.value.tasks?.tasks.length ?? 0) === 0,
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

/** The vehicle whose lease this page has: the confirmation of sticks is for one vehicle and one lease. */
const leaseOf = computed(() => (manualControl.value.phase === "off" ? null : manualControl.value.vehicle));

export function watchCapabilities(): void {
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
    reportProblem(`Read what ${vehicle} follows`, error);
  }
}

/** What blocks an entry may end at any time: the check repeats by itself. */
const CHECK_AGAIN_MS = 5_000;
let questions = 0;

function forgetCheck(): void {
  questions += 1;
  entryCheck.value = null;
  checkingEntry.value = false;
}

/** Asks what an entry would find now. The newest answer counts. */
export async function checkEntry(): Promise<void> {
  const vehicle = manualControl.peek().vehicle;
  if (vehicle === null) return;
  const mine = ++questions;
  checkingEntry.value = true;
  try {
    const found = await api.entryCheck(vehicle, sticksHeld.peek());
    if (mine === questions) entryCheck.value = found;
  } catch (error) {
    if (mine !== questions) return;
    entryCheck.value = null;
    reportProblem(`Check ${vehicle} before an entry`, error);
  } finally {
    if (mine === questions) {
      checkingEntry.value = false;
      if (entryCheck.value?.ready !== true) setTimeout(() => mine === questions && void checkEntry(), CHECK_AGAIN_MS);
    }
  }
}
