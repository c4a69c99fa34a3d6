import { describe, expect, it } from "vitest";
import type { EventKind, Job } from "../../api/types";
import { EMPTY_WORLD, reduce } from "../../store/world";
import { because, sampleEvent, sampleJob } from "../../testing/samples";
import { affectsAssignment, groupJobs, isCancellable, isClaimClearable, moveTo, stoppedQueues } from "./lists";

const queue = (vehicle_id: string, stopped: boolean, at: number | null) => ({
  vehicle_id,
  stopped,
  reason: stopped ? because("job.run_bad", { run_id: "r1", state: "failed" }) : null,
  actor: "waydrop",
  at,
  cleared_run_id: null,
});

describe("lists of jobs", () => {
  it("are reordered by a place before another job, or at the end of its priority", () => {
    const waiting = [
      sampleJob({ id: "a", priority: 5 }),
      sampleJob({ id: "b", priority: 5 }),
      sampleJob({ id: "c" }),
      sampleJob({ id: "d" }),
    ];
    expect(moveTo(waiting, 2, 0)).toEqual({ before: "a" });
    expect(moveTo(waiting, 0, 2)).toEqual({ before: "d" });
    expect(moveTo(waiting, 0, 1)).toEqual({ priority: 5, place: "last" });
    expect(moveTo(waiting, 0, 3)).toEqual({ priority: 0, place: "last" });
    expect([moveTo(waiting, 1, 1), moveTo(waiting, 1, 4), moveTo(waiting, 7, 1)]).toEqual([null, null, null]);
  });

  it("has those with a vehicle first, waits in the service's order, and shows the newest ends", () => {
    const jobs = [
      sampleJob({ id: "low", priority: -1, rank: 0 }),
      sampleJob({ id: "second", rank: 5 }),
      sampleJob({ id: "first", rank: 4 }),
      sampleJob({ id: "flies", state: "flying", vehicle_id: "v1" }),
      sampleJob({ id: "old", state: "completed", ended_at: 5 }),
      sampleJob({ id: "new", state: "failed", ended_at: 9 }),
    ];
    const { active, waiting, over } = groupJobs(Object.fromEntries(jobs.map((job) => [job.id, job])));
    expect([active, waiting, over].map((list) => list.map(({ id }) => id))).toEqual([
      ["flies"],
      ["first", "second", "low"],
      ["new", "old"],
    ]);
  });

  it("offers to cancel what does not fly and is not being taken off already", () => {
    expect(isCancellable(sampleJob())).toBe(true);
    expect(isCancellable(sampleJob({ state: "prepared", end_requested: "cancelled" }))).toBe(false);
    expect(isCancellable(sampleJob({ state: "flying" }))).toBe(false);
  });

  it("offers to clear the claim of a gateway that does not answer", () => {
    const claim = { site: "north", gateway: "gw-1", taken: false };
    const given = sampleJob({ state: "preparing", claim });
    const taken = sampleJob({ state: "prepared", claim: { ...claim, taken: true } });
    expect([isClaimClearable(given, true), isClaimClearable(taken, true)]).toEqual([true, false]);
    expect(isClaimClearable(taken, false)).toBe(true);
    expect(isClaimClearable({ ...taken, state: "flying" }, false)).toBe(false);
    expect(isClaimClearable(sampleJob({ state: "prepared" }), false)).toBe(false);
  });

  it("asks again who could have a job after what may change it, and not after every word of a vehicle", () => {
    const kinds: EventKind[] = ["vehicle.changed", "vehicle.link_lost", "job.changed", "run.changed", "offboard.lease"];
    expect(kinds.every(affectsAssignment)).toBe(true);
    const others: EventKind[] = ["vehicle.status_text", "vehicle.command", "run.ack", "plan.created"];
    expect(others.some(affectsAssignment)).toBe(false);
  });
});

describe("jobs of the world", () => {
  it("never go back behind what is known", () => {
    const known = reduce(EMPTY_WORLD, {
      type: "jobs_read",
      jobs: [sampleJob({ state: "flying", updated_at: 9 })],
      queues: [queue("v1", true, 9)],
    });
    const late = reduce(known, {
      type: "jobs_read",
      jobs: [sampleJob({ updated_at: 8 })],
      queues: [queue("v1", false, 8)],
    });
    expect(late.jobs["job-1"]?.state).toBe("flying");
    expect(stoppedQueues(late.jobQueues).map((one) => one.vehicle_id)).toEqual(["v1"]);
    expect(
      stoppedQueues(reduce(late, { type: "jobs_read", jobs: [], queues: [queue("v1", false, 10)] }).jobQueues),
    ).toEqual([]);
  });

  it("go by the fencing number before the time, which differs between machines", () => {
    const claim = { site: "north", gateway: "gw-1", taken: false };
    const given = sampleJob({ state: "preparing", fence: 2, claim, updated_at: 20 });
    const taken = { ...given, claim: { ...claim, taken: true }, updated_at: 15 };
    const cleared = sampleJob({ fence: 3, updated_at: 19 });
    const jobs = (...read: Job[]) => reduce(EMPTY_WORLD, { type: "jobs_read", jobs: read, queues: [] }).jobs["job-1"];
    expect(jobs(given, taken)).toBe(taken);
    expect(jobs(taken, given)).toBe(taken);
    expect(jobs(taken, cleared, { ...taken, state: "flying", updated_at: 30 })).toBe(cleared);
  });

  it("go by what was asked for last where the service's clock was set back", () => {
    const jobs = { "job-1": sampleJob({ state: "flying", updated_at: 900 }) };
    const before = { ...EMPTY_WORLD, jobs, jobQueues: { v1: queue("v1", true, 900) } };
    const read = { jobs: [sampleJob({ state: "completed", updated_at: 300 })], queues: [queue("v1", false, 300)] };
    const after = reduce(before, { type: "jobs_read", ...read, asked: before });
    expect([after.jobs["job-1"]?.state, after.jobQueues["v1"]?.stopped]).toEqual(["completed", false]);
    const told = { ...before, jobs: { "job-1": sampleJob({ state: "flying", updated_at: 901 }) } }; // meanwhile
    expect(reduce(told, { type: "jobs_read", ...read, asked: before }).jobs["job-1"]?.state).toBe("flying");
  });

  it("are read although there are tens of thousands of them", () => {
    const readJobs = (count: number) => {
      const read = Array.from({ length: count }, (_, index) => sampleJob({ id: `job-${index}`, rank: index }));
      return Object.keys(reduce(EMPTY_WORLD, { type: "jobs_read", jobs: read, queues: [], gone: read }).jobs).length;
    };
    expect(readJobs(20_000)).toBe(20_000);
  });

  it("follow their events", () => {
    const event = sampleEvent(6, {
      kind: "job.changed",
      vehicle_id: "v1",
      run_id: "r1",
      data: { change: "assigned", job: sampleJob({ state: "preparing", vehicle_id: "v1", updated_at: 1 }) },
    });
    const world = reduce(
      { ...EMPTY_WORLD, gateway: "g", seq: 5, jobs: { "job-1": sampleJob() } },
      { type: "frame", frame: { type: "event", event }, at: 0 },
    );
    expect(world.jobs["job-1"]).toMatchObject({ state: "preparing", vehicle_id: "v1" });
  });
});
