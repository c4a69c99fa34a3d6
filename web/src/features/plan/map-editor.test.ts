import { expect, it, vi } from "vitest";
import { sampleVehicle } from "../../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { receiveFrame } = await import("../../store/store");
const { vehicleId } = await import("../../store/selection");
const { draftPlan } = await import("./draft-text");
const { startNewPlan } = await import("./map-editor");

it.each([
  [null, "vtol"],
  ["v2", "rover"],
  ["v9", "multicopter"], // not known: no other vehicle's type
])("a new plan is for the chosen vehicle (%s): %s", (chosen, type) => {
  const vehicles = [sampleVehicle({ vehicle_type: "vtol" }), sampleVehicle({ id: "v2", vehicle_type: "rover" })];
  receiveFrame({ type: "snapshot", seq: 0, vehicles, runs: [] });
  vehicleId.value = chosen;
  startNewPlan();
  expect(draftPlan.value?.vehicle_type).toBe(type);
});
