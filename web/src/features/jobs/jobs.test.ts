import { beforeEach, describe, expect, it, vi } from "vitest";
import type { Job } from "../../api/types";
import { sampleJob } from "../../testing/samples";

vi.stubGlobal("location", { hash: "#panel=jobs" });
vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, 16));
vi.stubGlobal("cancelAnimationFrame", (handle: ReturnType<typeof setTimeout>) => clearTimeout(handle));
let open: Job[] = [];
let pages = 1;
let newest: Job[] = [];
let whileReading: () => void = () => undefined;
const answer = async (ask: { open?: boolean; older_than?: string | null }) => {
  await Promise.resolve();
  whileReading();
  if (ask.open !== true) return { jobs: newest, next: null };
  const page = Number(ask.older_than ?? 0) + 1;
  return { jobs: page === pages ? open : [], next: page === pages ? null : String(page) };
};
vi.doMock("../../api/client", () => ({ api: { jobs: answer, jobQueues: async () => ({ vehicles: [] }) } }));
const { dispatch, jobs, status } = await import("../../store/store");
const { watchJobs } = await import("./jobs");
watchJobs();

const known = () => Object.values(jobs.value).map(({ id, state }) => [id, state]);

/** The stream was lost, and is back. */
async function rejoin(): Promise<void> {
  for (const kind of ["connecting", "live"] as const) status.value = { kind };
  await new Promise((done) => setTimeout(done, 0));
}

describe("jobs after the stream was lost", () => {
  beforeEach(() => {
    whileReading = () => undefined;
    dispatch({ type: "after_refused" });
  });

  it("no longer show one as open that ended unheard, too long ago to be among the newest", async () => {
    dispatch({
      type: "jobs_read",
      jobs: [
        sampleJob({ id: "a", state: "flying" }),
        sampleJob({ id: "b" }),
        sampleJob({ id: "c", state: "completed" }),
      ],
      queues: [],
    });
    open = [sampleJob({ id: "b" })];
    newest = [sampleJob({ id: "d", state: "completed" })];
    await rejoin();
    expect(known()).toEqual([
      ["b", "queued"],
      ["c", "completed"],
      ["d", "completed"],
    ]);
  });

  it("keep what is told while they are read", async () => {
    dispatch({ type: "jobs_read", jobs: [sampleJob({ id: "a", state: "prepared" })], queues: [] });
    open = newest = [];
    whileReading = () =>
      dispatch({
        type: "jobs_read",
        jobs: [sampleJob({ id: "a", state: "flying", updated_at: 101 }), sampleJob({ id: "e" })],
        queues: [],
      });
    await rejoin();
    expect(known()).toEqual([
      ["a", "flying"],
      ["e", "queued"],
    ]);
  });

  it("are read to the last page: the oldest are the next ones", async () => {
    pages = 15;
    dispatch({ type: "jobs_read", jobs: [sampleJob({ id: "oldest" })], queues: [] });
    open = [sampleJob({ id: "oldest" }), sampleJob({ id: "unheard" })];
    newest = [];
    await rejoin();
    pages = 1;
    expect(known()).toEqual([
      ["oldest", "queued"],
      ["unheard", "queued"],
    ]);
  });

  it("are forgotten with the journal of another service", async () => {
    dispatch({ type: "jobs_read", jobs: [sampleJob({ id: "a" })], queues: [] });
    dispatch({ type: "after_refused" });
    expect(known()).toEqual([]);
  });
});
