import { beforeEach, describe, expect, it, vi } from "vitest";
import type { OffboardDetail, VehicleType } from "../../api/types";
import { sampleState, sampleVehicle } from "../../testing/samples";
import { pressKey, releaseKey } from "./controls";
import { FakeSocket, stubPage } from "./testing/fake-page";

vi.useFakeTimers();
const page = stubPage("#panel=offboard&vehicle=v3");
let knows: OffboardDetail;
let ready = true;
vi.doMock("../../api/client", () => ({
  api: {
    offboard: async () => knows,
    entryCheck: async () => ({ ready, reason: "", hint: "", audit: [], control_method: knows.tasks.control_method }),
    tasks: async () => null,
  },
}));
const { dispatch, status } = await import("../../store/store");
const { heldKeys, goToArmed, leftKnob, rightKnob } = await import("./control-state");
const { manualControl, steering } = await import("./control-state");
const { offboardDetail, entryCheck, tasksOnly, watchCapabilities } = await import("./capabilities");
const { panel, selectVehicle } = await import("../../store/selection");
const {
  requestQueue,
  enterOffboard,
  releaseLease,
  goToPoint,
  offerLease,
  leaveOffboard,
  acquireLease,
  watchManualControl,
} = await import("./control-session");
watchManualControl();
watchCapabilities();
status.value = { kind: "live" } as typeof status.value;

/** A vehicle in the air, and the capability table's word on it. */
async function choose(
  type: VehicleType,
  follows: boolean,
  controlMethod: "setpoints" | "commands" | null,
): Promise<void> {
  knows = {
    offboard: {},
    capabilities: [
      { form: "velocity_body", accepted: follows },
      { form: "position_global", accepted: follows },
    ],
    tasks: { control_method: controlMethod, reason: "", hint: "" },
    limits: {},
  } as unknown as OffboardDetail;
  const vehicle = sampleVehicle({
    id: "v3",
    vehicle_type: type,
    firmware: `${type} ${follows} ${controlMethod}`,
    state: sampleState({ armed: true }),
  });
  dispatch({ type: "vehicles_read", vehicles: [vehicle] });
  await vi.advanceTimersByTimeAsync(5);
  expect(offboardDetail.value).toEqual(knows);
}

const socket = () => FakeSocket.all.at(-1) as FakeSocket;
const sent = (type: string) =>
  FakeSocket.all.flatMap((one) => one.sent).filter((frame) => frame["type"] === type).length;
const state = (fields: object) =>
  socket().tell({
    type: "state",
    offboard: {
      state: "active",
      lease: null,
      reason: null,
      sent: null,
      rate: null,
      tasks: null,
      control_method: knows.tasks.control_method,
      command: null,
      ...fields,
    },
  });
const queueIs = (word: string) =>
  socket().tell({
    type: "tasks",
    queue: {
      report: { state: word, reason: null, remaining_s: -1, task_list: [0], current_id: null },
      tasks: [],
      when_empty: "wait",
    },
  });

/** Numbers that are the same in each run (a Park-Miller generator). */
function random(seed: number): (below: number) => number {
  let now = seed;
  return (below) => {
    now = (now * 48271) % 2147483647;
    return now % below;
  };
}

const KEYS = ["KeyW", "KeyA", "ArrowUp", "KeyR", "KeyQ", "PageDown"];

/** All that a person, a browser, a lying gamepad and a service may do at once, in any order. */
function anything(next: (below: number) => number): void {
  const key = KEYS[next(KEYS.length)] as string;
  const axis = () => (next(3) - 1) as number;
  const acts: readonly (() => unknown)[] = [
    () =>
      (heldKeys.value = pressKey(heldKeys.value, {
        code: key,
        repeat: false,
        ctrlKey: false,
        altKey: false,
        metaKey: false,
      })),
    () => (heldKeys.value = releaseKey(heldKeys.value, key)),
    () => page.window.dispatchEvent(Object.assign(new Event("keyup"), { code: key })),
    () => (leftKnob.value = [axis(), axis()]),
    () => (rightKnob.value = [axis(), axis()]),
    () =>
      (page.pad = {
        id: "pad",
        connected: true,
        mapping: "standard",
        axes: [axis(), axis(), axis(), axis()],
        buttons: [{ pressed: next(2) === 1 }],
      }),
    () => (page.pad = { id: "pad", connected: true, mapping: "standard", axes: [0, 0, 0, 0], buttons: [] }),
    () => {
      goToArmed.value = true;
      goToPoint([8.55, 47.4]);
    },
    () => page.window.dispatchEvent(new Event("blur")),
    () => page.focus(next(4) !== 0),
    () => {
      page.document.hidden = next(4) === 0;
      page.document.dispatchEvent(new Event("visibilitychange"));
    },
    () =>
      void requestQueue("Add", { type: "task", task: { type: "goto" } as never, insert: "append", when_empty: "wait" }),
    () => void requestQueue("Resume", { type: "queue", action: "resume" }),
    () => void requestQueue("Pause", { type: "queue", action: "pause" }),
    () => (FakeSocket.refuses = ["queue", "task", "leave", "enter", null, null, null][next(7)] ?? null),
    () => queueIs(["idle", "waiting", "flying", "standing", "paused", "manual", "ending"][next(7)] as string),
    () => state({ control_method: [null, knows.tasks.control_method][next(2)] }),
    () => void offerLease(null),
    () => next(8) === 0 && page.window.dispatchEvent(Object.assign(new Event("keydown"), { code: "Escape" })),
    () => next(8) === 0 && void leaveOffboard("mission"),
    () => next(8) === 0 && page.window.dispatchEvent(new Event("pagehide")),
    () => next(8) === 0 && socket().onclose?.({ code: 1006, reason: "" }),
  ];
  acts[next(acts.length)]?.();
}

/** So many moments of it; a lease that is lost is taken anew. How often it came under control. */
async function soak(steps: number): Promise<number> {
  const next = random(7);
  let entries = 0;
  for (let step = 0; step < steps; step += 1) {
    const { phase } = manualControl.value;
    if (phase === "off") {
      FakeSocket.refuses = null;
      page.document.hidden = false;
      page.focus(true);
      acquireLease("v3");
      if (step % 3 === 0) setTimeout(() => state({}), 0); // taken over in flight
    } else if (phase === "leased") {
      void enterOffboard();
      entries += 1;
    } else {
      anything(next);
    }
    await vi.advanceTimersByTimeAsync(20 + next(1200));
  }
  releaseLease();
  return entries;
}

beforeEach(() => {
  FakeSocket.all = [];
});

describe("a lease", () => {
  it("is checked again by itself until the vehicle can be taken", async () => {
    await choose("multicopter", true, "setpoints");
    ready = false;
    acquireLease("v3");
    await vi.advanceTimersByTimeAsync(100);
    expect(entryCheck.value?.ready).toBe(false);
    ready = true;
    await vi.advanceTimersByTimeAsync(6_000);
    expect(entryCheck.value?.ready).toBe(true);
    releaseLease();
  });

  it("is given back by leaving the view or choosing another vehicle, and the panel says which", async () => {
    await choose("multicopter", true, "setpoints");
    const lostBy = async (leave: () => void) => {
      acquireLease("v3");
      await vi.advanceTimersByTimeAsync(10);
      leave();
      const { phase, ended } = manualControl.value;
      panel.value = "offboard";
      selectVehicle("v3");
      return [phase, ended];
    };
    expect(await lostBy(() => (panel.value = "run"))).toEqual([
      "off",
      "You left this panel, which released the lease of v3.",
    ]);
    expect(await lostBy(() => selectVehicle("v4"))).toEqual([
      "off",
      "You selected another vehicle, which released the lease of v3.",
    ]);
    expect(await lostBy(releaseLease)).toEqual(["off", "You released the lease."]);
  });
});

describe("a session for tasks only", () => {
  it.each(["commands", "setpoints"] as const)(
    "never sends a setpoint, whatever is pressed, moved, blurred or answered (tasks by %s)",
    async (by) => {
      await choose("fixed_wing", false, by);
      expect(tasksOnly.value).toBe(true);
      const entries = await soak(2000);
      expect(entries).toBeGreaterThan(20);
      expect([sent("acquire_lease") > 20, sent("enter") > 20, sent("task") > 20, sent("renew_lease") > 20]).toEqual([
        true,
        true,
        true,
        true,
      ]);
      expect(sent("setpoint")).toBe(0);
    },
  );

  it("is not what a vehicle gets that follows controls: the same sends setpoints there", async () => {
    await choose("multicopter", true, "setpoints");
    expect(tasksOnly.value).toBe(false);
    await soak(400);
    expect(sent("setpoint")).toBeGreaterThan(500);
  });

  it("begins with an entry too, for a VTOL that was taken hovering and is a wing by then", async () => {
    await choose("vtol", true, "setpoints");
    acquireLease("v3");
    await vi.advanceTimersByTimeAsync(10);
    await choose("vtol", false, "commands");
    void enterOffboard();
    await vi.advanceTimersByTimeAsync(3000);
    expect([manualControl.value.phase, manualControl.value.tasksOnly, steering.value, sent("setpoint")]).toEqual([
      "flying",
      true,
      false,
      0,
    ]);
    releaseLease();
  });

  it("is not offered for what flies no tasks, nor before anything is known of it", async () => {
    await choose("airship", false, null);
    expect(tasksOnly.value).toBe(false);
    dispatch({
      type: "vehicles_read",
      vehicles: [
        sampleVehicle({ id: "v3", vehicle_type: "fixed_wing", firmware: "other" }),
        sampleVehicle({ id: "v4" }),
      ],
    });
    expect(tasksOnly.value).toBe(false);
  });
});
