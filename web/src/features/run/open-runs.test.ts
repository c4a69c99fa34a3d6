import { expect, it, vi } from "vitest";
import { sampleRun } from "../../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { receiveFrame } = await import("../../store/store");
const { selectRun } = await import("../../store/selection");
const { listedRuns } = await import("./open-runs");

function show(...runs: ReturnType<typeof sampleRun>[]): string[] {
  receiveFrame({ type: "snapshot", seq: 0, vehicles: [], runs });
  selectRun("r1");
  return listedRuns.value.map(({ id }) => id);
}

it("open runs are listed whenever one of them is not shown", () => {
  const other = sampleRun({ id: "r2", vehicle_id: "v2", created_at: 101 });
  const ended = sampleRun({ state: "failed" });
  expect(show(sampleRun())).toEqual([]);
  expect(show(sampleRun(), { ...other, state: "completed" })).toEqual([]);
  expect(show(sampleRun(), other)).toEqual(["r1", "r2"]);
  expect(show(ended, other)).toEqual(["r2"]);
});
