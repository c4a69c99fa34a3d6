import { describe, expect, it } from "vitest";
import type { EventKind, Run } from "../api/types";
import { type EventFields, sampleDrop, sampleEvent, sampleRun, sampleVehicle } from "../testing/samples";
import { applyEvent, EMPTY_WORLD, reduce, type World } from "./world";

const WORLD: World = { ...EMPTY_WORLD, vehicles: { v1: sampleVehicle() }, runs: { r1: sampleRun() } };

function worldAfter(kind: EventKind, data: object, fields: EventFields = {}): World {
  return applyEvent(WORLD, sampleEvent(1, { kind, data, vehicle_id: "v1", run_id: "r1", ...fields }));
}

describe("events of a vehicle", () => {
  it("tell that its link is lost and restored", () => {
    expect(worldAfter("vehicle.link_lost", {}).vehicles["v1"]?.state.connected).toBe(false);
    expect(worldAfter("vehicle.link_restored", {}).vehicles["v1"]?.state.connected).toBe(true);
  });

  it("change mode, armed and landed and leave the rest", () => {
    const state = worldAfter("vehicle.changed", { mode: "mission", armed: true, landed: "in_air" }).vehicles["v1"]
      ?.state;
    expect(state).toMatchObject({ mode: "mission", armed: true, landed: "in_air", battery_percent: 90 });
  });

  it("end its quarantine", () => {
    const quarantined = worldAfter("vehicle.quarantined", { reason: { code: "vehicle.two_clocks", params: {} } });
    const ended = sampleEvent(2, { kind: "vehicle.quarantine_ended", data: { actor: null }, vehicle_id: "v1" });
    expect(applyEvent(quarantined, ended).vehicles["v1"]?.quarantined).toBeNull();
  });

  it("quarantine it with the reason", () => {
    expect(
      worldAfter("vehicle.quarantined", { reason: { code: "vehicle.two_clocks", params: {} } }).vehicles["v1"]
        ?.quarantined,
    ).toEqual({ code: "vehicle.two_clocks", params: {} });
  });

  it("are not undone by a list that was asked for before them", () => {
    const reason = { code: "vehicle.two_clocks", params: {} } as const;
    const told = worldAfter("vehicle.quarantined", { reason });
    const list = [sampleVehicle({ firmware: "1.19.0" }), sampleVehicle({ id: "v7" })];
    const late = reduce(told, { type: "vehicles_read", vehicles: list, asked: WORLD });
    expect(late.vehicles["v1"]).toMatchObject({ quarantined: reason, firmware: "1.19.0" });
    expect(Object.keys(late.vehicles)).toEqual(["v1", "v7"]);
    const healed = reduce(late, { type: "vehicles_read", vehicles: list, asked: late });
    expect(healed.vehicles["v1"]?.quarantined).toBeNull();
  });

  it("are not lost of a new one to a list that was asked for before them", () => {
    const v7 = { vehicle_id: "v7" };
    const reason = { code: "vehicle.two_clocks", params: {}, cause: null } as const;
    const asked = worldAfter("vehicle.seen", {}, v7);
    const told = applyEvent(asked, sampleEvent(2, { kind: "vehicle.quarantined", data: { reason }, ...v7 }));
    const late = reduce(told, { type: "vehicles_read", vehicles: [sampleVehicle({ id: "v7" })], asked });
    expect(late.listStale).toBe(true);
    const again = [sampleVehicle({ id: "v7", quarantined: reason })];
    const read = reduce(late, { type: "vehicles_read", vehicles: again, asked: late });
    expect([read.listStale, read.vehicles["v7"]?.quarantined]).toEqual([false, reason]);
  });

  it("complete what is known of it", () => {
    expect(
      worldAfter("vehicle.seen", { firmware: "1.19.0", uid: null, vehicle_type: null }).vehicles["v1"],
    ).toMatchObject({
      firmware: "1.19.0",
      vehicle_type: "multicopter",
    });
  });

  it("that is new ask for the list", () => {
    expect(worldAfter("vehicle.seen", {}, { vehicle_id: "v7" }).listStale).toBe(true);
  });

  it("that is unknown change nothing", () => {
    expect(worldAfter("vehicle.changed", { mode: "land" }, { vehicle_id: "v7" })).toBe(WORLD);
  });
});

describe("events of a run", () => {
  it("replace it when it changed", () => {
    expect(worldAfter("run.changed", { ...sampleRun({ state: "landed", updated_at: 101 }) }).runs["r1"]?.state).toBe(
      "landed",
    );
  });

  it("replace it also where the service's clock was set back", () => {
    expect(worldAfter("run.changed", { ...sampleRun({ state: "paused", updated_at: -500 }) }).runs["r1"]?.state).toBe(
      "paused",
    );
  });

  it("never go back behind the gateway that took it over", () => {
    const taken_over = { number: 1 } as Run["taken_over"];
    const taken = worldAfter("run.taken_over", { ...sampleRun({ taken_over, updated_at: 40 }) });
    const lost = sampleEvent(2, { kind: "run.changed", data: { ...sampleRun({ state: "lost", updated_at: 200 }) } });
    expect(applyEvent(taken, lost).runs["r1"]).toMatchObject({ state: "flying", taken_over });
  });

  it("count the upload", () => {
    expect(worldAfter("run.upload_progress", { percent: 40 }).runs["r1"]?.upload_percent).toBe(40);
  });

  it("move the current item, and keep the items that were flown, each visit once", () => {
    expect(worldAfter("run.item", { item_id: "b", phase: "current" }).runs["r1"]?.item_id).toBe("b");
    const once = worldAfter("run.item", { item_id: "a", phase: "reached" });
    const twice = applyEvent(
      once,
      sampleEvent(2, { kind: "run.item", run_id: "r1", data: { item_id: "a", phase: "reached" } }),
    );
    expect(twice.runs["r1"]?.flown_item_ids).toEqual(["a"]);
  });

  it("keep the evidence of the drop that they are about", () => {
    const drop = sampleDrop({ outcome: "released", certainty: "acknowledged" });
    expect(worldAfter("run.drop", { ...drop }).runs["r1"]?.drops).toEqual([drop]);
    expect(worldAfter("run.drop", { ...drop, plan_item_id: "other" }).runs["r1"]?.drops).toEqual(
      WORLD.runs["r1"]?.drops,
    );
  });
});

it("an event of a kind that this page does not know changes nothing", () => {
  expect(worldAfter("vehicle.teleported" as EventKind, { mode: "x" })).toBe(WORLD);
});
