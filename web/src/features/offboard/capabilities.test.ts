import { expect, it, vi } from "vitest";
import { NO_CONTROL, type Phase } from "./session";

vi.stubGlobal("location", { hash: "" });
const { manualControl } = await import("./control-state");
const { sticksHeld, watchCapabilities } = await import("./capabilities");

const turn = (phase: Phase, vehicle: string | null) => (manualControl.value = { ...NO_CONTROL, phase, vehicle });

it("that a pilot holds the sticks is said of one vehicle and for one lease", () => {
  watchCapabilities();
  turn("leased", "v1");
  sticksHeld.value = true;
  for (const phase of ["entering", "leased", "entering", "flying", "silent"] as const) turn(phase, "v1");
  expect(sticksHeld.value).toBe(true);
  turn("off", "v1");
  expect(sticksHeld.value).toBe(false);
  turn("opening", "v1");
  sticksHeld.value = true;
  turn("leased", "v2");
  expect(sticksHeld.value).toBe(false);
});
