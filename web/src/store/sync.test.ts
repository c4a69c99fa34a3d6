import { afterEach, beforeEach, expect, it, vi } from "vitest";
import type { Principal, Vehicle } from "../api/types";
import { sampleEvent, sampleState, sampleVehicle } from "../testing/samples";

const page = { location: { href: "http://page.test/" }, addEventListener: () => undefined };
vi.stubGlobal("window", page);
vi.stubGlobal("document", page);
vi.stubGlobal("requestAnimationFrame", (draw: () => void) => draw());
vi.stubGlobal("cancelAnimationFrame", () => undefined);
vi.stubGlobal(
  "WebSocket",
  class {
    close = () => undefined;
  },
);
const vehicles = vi.fn<() => Promise<Vehicle[]>>(() => Promise.reject(new Error("no answer")));
const answers: ((known: Principal) => void)[] = [];
const askPrincipal = () => new Promise<Principal>((answer) => answers.push(answer));
vi.doMock("../api/client", () => ({ api: { vehicles, principal: askPrincipal } }));
const { receiveFrame, status, world } = await import("./store");
const { hasRole, principal, watchPrincipal } = await import("./principal");
const { enterToken, startSync } = await import("./sync");

const live = () => (status.value = { kind: "live" });
const viewer: Principal = { name: "desk", role: "viewer", roles: ["viewer"] };
const pilot: Principal = { name: "ann", role: "pilot", roles: ["viewer", "dispatcher", "pilot"] };

beforeEach(() => void vi.useFakeTimers());
afterEach(async () => {
  await vi.advanceTimersByTimeAsync(5_000); // what waits to ask again
  vi.useRealTimers();
});

it("a list of the fleet that cannot be read is asked for again after some seconds, not with each frame", async () => {
  startSync();
  live();
  const frames = async (count: number) => {
    for (let i = 0; i < count; i++) {
      receiveFrame({ type: "telemetry", time: i, recording: true, vehicles: { v9: sampleState() } });
      await vi.advanceTimersByTimeAsync(250);
    }
    return vehicles.mock.calls.length;
  };
  expect([await frames(8), await frames(16)]).toEqual([1, 2]);
});

it("a list that is older than what was told of a new vehicle is asked for again", async () => {
  const reason = { code: "vehicle.two_clocks", params: {}, cause: null } as const;
  const answers: ((list: Vehicle[]) => void)[] = [];
  vehicles.mockImplementation(() => new Promise((answer) => answers.push(answer)));
  live();
  receiveFrame({ type: "hello", gateway: "gw1", first_seq: 1, seq: 0, server_time: 0 });
  const answered = async (quarantined: Vehicle["quarantined"]) => {
    receiveFrame({ type: "telemetry", time: 1, recording: true, vehicles: { v9: sampleState() } });
    await vi.advanceTimersByTimeAsync(250);
    answers.shift()?.([sampleVehicle({ id: "v9", quarantined })]);
    await vi.advanceTimersByTimeAsync(0);
    return world.value.vehicles["v9"]?.quarantined;
  };
  receiveFrame({ type: "telemetry", time: 1, recording: true, vehicles: { v9: sampleState() } });
  await vi.advanceTimersByTimeAsync(250);
  const event = sampleEvent(1, { kind: "vehicle.quarantined", data: { reason }, vehicle_id: "v9" });
  receiveFrame({ type: "event", event });
  expect([await answered(null), await answered(reason)]).toEqual([undefined, reason]);
});

it("the roles are those of the token that was entered last, whichever answer comes first", async () => {
  watchPrincipal();
  live();
  answers[0]?.(viewer);
  await vi.advanceTimersByTimeAsync(0);
  expect(hasRole("pilot")).toBe(false);
  enterToken("another");
  expect(principal.value).toBeNull();
  live();
  enterToken("third");
  live();
  answers[2]?.(pilot);
  answers[1]?.(viewer);
  await vi.advanceTimersByTimeAsync(0);
  expect(principal.value).toEqual(pilot);
});
