import { describe, expect, it } from "vitest";
import type { StreamEvent, StreamFrame } from "../api/types";
import { sampleEvent, sampleJob, sampleRun, sampleState, sampleVehicle } from "../testing/samples";
import { EMPTY_WORLD, FEED_LIMIT, MOST_ENDED, REPLAYED_EVENTS, reduce, type World } from "./world";

const hello = (seq: number, gateway = "gw1"): StreamFrame => ({
  type: "hello",
  gateway,
  first_seq: 1,
  seq,
  server_time: 0,
});
const snapshot = (seq: number): StreamFrame => ({
  type: "snapshot",
  seq,
  vehicles: [sampleVehicle()],
  runs: [sampleRun()],
});
const event = (seq: number, fields: Partial<StreamEvent> = {}): StreamFrame => ({
  type: "event",
  event: sampleEvent(seq, fields),
});

function take(world: World, ...frames: StreamFrame[]): World {
  return frames.reduce((before, frame) => reduce(before, { type: "frame", frame, at: 5 }), world);
}

function reopened(world: World): World {
  return reduce(world, { type: "opened" });
}

/** A page that has connected to a journal with `seq` events and has taken in all of them. */
function caughtUp(seq: number): World {
  const first = take(EMPTY_WORLD, hello(seq));
  const again = take(reopened(first), hello(seq), snapshot(seq));
  const missing = Array.from({ length: seq - (again.seq ?? 0) }, (_, i) => event((again.seq ?? 0) + 1 + i));
  return take(again, ...missing);
}

const seqs = (world: World) => world.feed.map(({ seq }) => seq);

describe("a page that is new", () => {
  it("asks again for the newest part of the journal", () => {
    const world = take(EMPTY_WORLD, hello(1000));
    expect([world.seq, world.resync]).toEqual([1000 - REPLAYED_EVENTS, true]);
  });

  it("asks for no event that was deleted by age", () => {
    const world = take(EMPTY_WORLD, { type: "hello", gateway: "gw1", first_seq: 951, seq: 1000, server_time: 0 });
    expect([world.seq, world.resync]).toEqual([950, true]);
  });

  it("does not ask again when the journal is empty", () => {
    expect(take(EMPTY_WORLD, hello(0))).toMatchObject({ seq: 0, resync: false });
  });

  it("ignores what the connection that it gives up still brings", () => {
    expect(take(EMPTY_WORLD, hello(50), snapshot(50), event(51)).feed).toEqual([]);
  });
});

describe("events", () => {
  it("come into the feed newest first, each once", () => {
    expect(seqs(take(caughtUp(3), event(4), event(4), event(2), event(5)))).toEqual([5, 4, 3, 2, 1]);
  });

  it("that leave a hole are not taken: the stream is asked for what is missing", () => {
    const world = take(caughtUp(3), event(5));
    expect([world.seq, world.resync, seqs(world)]).toEqual([3, true, [3, 2, 1]]);
    expect(seqs(take(reopened(world), hello(5), snapshot(5), event(4), event(5)))).toEqual([5, 4, 3, 2, 1]);
  });

  it("that the service no longer has are said to be missing", () => {
    const again = reopened(take(caughtUp(3), event(9)));
    const world = take(again, hello(9), snapshot(9), event(9));
    expect(world.feed.slice(0, 2).map(({ kind, data }) => [kind, data])).toEqual([
      ["service.started", {}],
      ["page.missing", { first: 4, last: 8 }],
    ]);
    expect([world.seq, world.resync]).toEqual([9, false]);
  });

  it("that a snapshot already holds are for the feed only", () => {
    const old = event(2, {
      kind: "run.changed",
      run_id: "r1",
      data: { ...sampleRun({ state: "uploading", updated_at: 1 }) },
    });
    const world = take(reopened(take(EMPTY_WORLD, hello(2))), hello(2), snapshot(2), event(1), old);
    expect(world.runs["r1"]?.state).toBe("flying");
    expect(seqs(world)).toEqual([2, 1]);
  });

  it("are kept up to a limit", () => {
    const world = take(caughtUp(0), ...Array.from({ length: FEED_LIMIT + 20 }, (_, i) => event(i + 1)));
    expect(world.feed.length).toBe(FEED_LIMIT);
    expect(world.feed[0]?.seq).toBe(FEED_LIMIT + 20);
  });
});

describe("another journal", () => {
  it("begins a new feed when the gateway is another one", () => {
    expect(take(caughtUp(3), hello(7, "gw2"))).toMatchObject({ gateway: "gw2", seq: 0, feed: [], resync: true });
  });

  it("begins a new feed when the service says that our place is in its future", () => {
    const world = reduce(caughtUp(9), { type: "after_refused" });
    expect([world.seq, world.feed]).toEqual([null, []]);
    expect(take(world, hello(4))).toMatchObject({ seq: 0, resync: true });
  });
});

describe("a snapshot, which has the open runs and the newest ones only", () => {
  const read = (fields: Parameters<typeof sampleRun>[0]) => (world: World) =>
    reduce(world, { type: "run_read", run: sampleRun(fields) });
  const known = [
    read({ id: "old", state: "completed" }),
    read({ id: "lost-sight-of", state: "flying" }),
    read({ id: "r1", state: "landed", updated_at: 99 }),
  ].reduce((world, take) => take(world), caughtUp(1));

  it("keeps the older ones that have ended, and none that it would have if it were still open", () => {
    const world = take(reopened(known), hello(1), snapshot(1));
    expect(Object.values(world.runs).map(({ id, state }) => [id, state])).toEqual([
      ["old", "completed"],
      ["r1", "flying"],
    ]);
  });

  it("keeps none of another service", () => {
    const other = take(reopened(take(reopened(known), hello(1, "gw2"))), hello(1, "gw2"), snapshot(1));
    expect(Object.keys(other.runs)).toEqual(["r1"]);
    const refused = reduce(known, { type: "after_refused" });
    expect(Object.keys(take(reopened(refused), hello(0, "gw2"), snapshot(0)).runs)).toEqual(["r1"]);
  });
});

describe("telemetry", () => {
  it("replaces the state and says when it was measured", () => {
    const world = take(caughtUp(1), {
      type: "telemetry",
      time: 9,
      recording: true,
      vehicles: { v1: sampleState({ battery_percent: 12 }) },
    });
    expect([world.vehicles["v1"]?.state.battery_percent, world.measuredAt]).toEqual([12, 5]);
  });

  it("keeps the page's idea of the service's clock right, which the greeting began", () => {
    const greeted = take(EMPTY_WORLD, { type: "hello", gateway: "gw1", first_seq: 1, seq: 0, server_time: 1_000 });
    expect(greeted.serviceAhead_s).toBeCloseTo(999.995);
    expect(take(greeted, { type: "telemetry", time: 1_060, recording: true, vehicles: {} }).serviceAhead_s).toBeCloseTo(
      1_059.995,
    );
  });

  it("says whether what it does not carry is current: runs, drops and jobs come by events", () => {
    const frame = { type: "telemetry", time: 9, vehicles: {} } as const;
    const stuck = take(caughtUp(1), { ...frame, recording: false });
    expect([stuck.recording, take(stuck, { ...frame, recording: true }).recording]).toEqual([false, true]);
  });

  it("of an unknown vehicle asks for the list and invents nothing", () => {
    const world = take(caughtUp(1), { type: "telemetry", time: 9, recording: true, vehicles: { v9: sampleState() } });
    expect([world.listStale, "v9" in world.vehicles]).toEqual([true, false]);
    const read = reduce(world, { type: "vehicles_read", vehicles: [sampleVehicle({ id: "v9" })] });
    expect([read.listStale, Object.keys(read.vehicles)]).toEqual([false, ["v9"]]);
  });
});

describe("an answer to a request", () => {
  it("never goes back behind what the stream has told", () => {
    const told = take(
      caughtUp(1),
      event(2, { kind: "run.changed", run_id: "r1", data: { ...sampleRun({ state: "landed", updated_at: 200 }) } }),
    );
    const late = reduce(told, { type: "run_read", run: sampleRun({ state: "starting", updated_at: 150 }) });
    expect(late.runs["r1"]?.state).toBe("landed");
  });

  it("brings a run that the stream has not told of yet", () => {
    expect(reduce(EMPTY_WORLD, { type: "run_read", run: sampleRun({ id: "r2" }) }).runs["r2"]?.id).toBe("r2");
  });
});

it("a page that stays open for weeks keeps the last runs and jobs that ended, and all that are open", () => {
  let world = reduce(EMPTY_WORLD, { type: "run_read", run: sampleRun({ id: "flying" }) });
  for (let i = 0; i < MOST_ENDED + 2; i++) {
    world = reduce(world, { type: "run_read", run: sampleRun({ id: `r${i}`, state: "completed" }) });
    const jobs = [sampleJob({ id: `j${i}`, state: "completed", ended_at: i })];
    world = reduce(world, { type: "jobs_read", jobs, queues: [] });
  }
  expect([Object.keys(world.runs).length, Object.keys(world.jobs).length]).toEqual([MOST_ENDED + 1, MOST_ENDED]);
  expect(["flying", "r1", "r2"].map((id) => id in world.runs)).toEqual([true, false, true]);
});

describe("no gap and no double", () => {
  /** Small repeatable randomness (mulberry32). */
  function random(seed: number): () => number {
    return () => {
      seed = (seed + 0x6d2b79f5) | 0;
      let t = Math.imul(seed ^ (seed >>> 15), 1 | seed);
      t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
      return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
    };
  }

  /**
   * What a service sends on one connection that is cut after some frames: replay, then live; a frame may come twice.
   */
  function connection(after: number | null, journal: number, cutAfter: number, roll: () => number): StreamFrame[] {
    const first = (after ?? journal) + 1;
    const events = Array.from({ length: Math.max(0, journal - first + 1) }, (_, i) => event(first + i));
    const doubled = events.flatMap((frame) => (roll() < 0.1 ? [frame, frame] : [frame]));
    const lossy = roll() < 0.2 ? doubled.filter(() => roll() > 0.05) : doubled;
    return [hello(journal), snapshot(journal), ...lossy].slice(0, cutAfter);
  }

  /** At last a connection lasts until everything was sent. */
  function whole(world: World, journal: number): World {
    let now = world;
    while (now.seq === null || now.seq < journal) {
      now = reopened(now);
      const first = (now.seq ?? journal) + 1;
      const missing = Array.from({ length: journal - first + 1 }, (_, i) => event(first + i));
      now = take(now, hello(journal), snapshot(journal), ...missing);
      if (journal === 0) break;
    }
    return now;
  }

  /** The numbers of all events in the feed, and of those that it says are missing. */
  function told(world: World): number[] {
    const numbers = world.feed.flatMap((event) => {
      if (event.kind !== "page.missing") return [event.seq];
      const { first, last } = event.data;
      return Array.from({ length: last - first + 1 }, (_, i) => first + i);
    });
    return numbers.sort((a, b) => a - b);
  }

  it("holds however often and wherever the connection is cut", () => {
    for (let seed = 1; seed <= 300; seed++) {
      const roll = random(seed);
      let [world, journal] = [EMPTY_WORLD, Math.floor(roll() * 30)];
      for (let tries = 0; tries < 12; tries++) {
        world = reopened(world);
        for (const frame of connection(world.seq, journal, Math.floor(roll() * 40), roll)) {
          world = take(world, frame);
          if (world.resync) break;
        }
        journal += Math.floor(roll() * 8);
      }
      expect(told(whole(world, journal)), `seed ${seed}`).toEqual(Array.from({ length: journal }, (_, i) => i + 1));
    }
  });
});
