import { expect, it, vi } from "vitest";
import type { Run } from "../../api/types";
import { sampleRun } from "../../testing/samples";

vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
const { receiveFrame } = await import("../../store/store");
const { selectRun } = await import("../../store/selection");
const { commonStart, include, listedRuns } = await import("../../store/common-start");
const { flightsOf } = await import("./open-runs");

function show(...runs: Run[]): string[] {
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

it("the common start includes what was included and left checked, whatever the operator looks at meanwhile", () => {
  const ready = [5, 6, 7, 8].map((n) => sampleRun({ id: `r${n}`, vehicle_id: `v${n}`, state: "uploaded" }));
  const listed = (...runs: typeof ready) => {
    show(...runs);
    return flightsOf(commonStart.value);
  };
  const [r5, r6, r7, r8] = ready as [Run, Run, Run, Run];
  expect(listed(r6)).toBe("0 flights");
  include("r6", true);
  expect(listed(r6)).toBe("1 flight: v6");
  expect(listed(r6, r7)).toBe("1 flight: v6"); // the second is not included by itself either
  include("r7", true);
  expect(listed(r6, r7)).toBe("2 flights: v6, v7");
  include("r6", false);
  expect(listed(r6, r7)).toBe("1 flight: v7");
  expect(listed(r5, r6, r7)).toBe("1 flight: v7"); // one that joins is not included by itself
  include("r5", true);
  expect(listed(r5, r6)).toBe("1 flight: v5");
  expect(listed(r6)).toBe("0 flights");
  expect(listed(r6, r8)).toBe("0 flights");
});
