/** Whether anybody did something at this page lately: keys, pointers and gamepads count wherever they are used. */

import { signal } from "@preact/signals";
import { Presence, type Attendance } from "../hands-on/presence";
import type { PadReading } from "../hands-on/gamepad";

const presence = new Presence();
/** As of the last look. */
export const attendance = signal<Attendance>("there");

export function touched(): void {
  presence.touch(performance.now());
  attendance.value = "there";
}

/** To be asked at every moment at which somebody's will is told. */
export function attendanceNow(pad: PadReading | null): Attendance {
  const now_ms = performance.now();
  presence.pad(pad, now_ms);
  return (attendance.value = presence.at(now_ms));
}

export function watchInput(): void {
  const options = { capture: true, passive: true };
  window.addEventListener("keydown", (event) => presence.key(event, performance.now()), options);
  window.addEventListener("pointermove", ({ screenX, screenY }) => presence.pointer(screenX, screenY, performance.now()), options);
  for (const press of ["pointerdown", "pointerup", "wheel"]) window.addEventListener(press, () => presence.touch(performance.now()), options);
}
