import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { api } from "./client";
import { ProblemError, toProblem } from "./problem";

let sent: { url: string; init: RequestInit }[];
let answer: () => Response;

beforeEach(() => {
  sent = [];
  answer = () => Response.json({ jobs: [], next: null });
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    sent.push({ url, init });
    return answer();
  });
});
afterEach(() => vi.unstubAllGlobals());

it("fills in the path encoded, and leaves out of the query what is not given", async () => {
  await api.run("a/b c");
  await api.jobs({ open: true, limit: 200, older_than: null });
  expect(sent.map(({ url }) => url)).toEqual(["/api/v1/runs/a%2Fb%20c", "/api/v1/jobs?open=true&limit=200"]);
});

it("sends what creates something with a key of its own", async () => {
  await api.createRun("p1", "v1", false, null);
  await api.createRun("p1", "v1", false, null);
  const keys = sent.map(({ init }) => new Headers(init.headers).get("Idempotency-Key"));
  expect([keys[0]?.length, keys[0] === keys[1]]).toEqual([32, false]);
  expect(JSON.parse(String(sent[0]?.init.body))).toEqual({ plan: "p1", vehicle: "v1", start: false, wind: null });
});

describe("a request that creates something and is sent again", () => {
  const keys = () => sent.map(({ init }) => new Headers(init.headers).get("Idempotency-Key"));
  const queue = (priority: number) => api.createJob({ plan: "p1", priority }).catch((error: unknown) => error);
  const lost = () => {
    throw new TypeError("network");
  };

  it("keeps its key until an answer came, so that it is carried out once", async () => {
    answer = lost;
    await queue(0);
    answer = () => new Response("<html>", { status: 504 });
    await queue(0);
    answer = () => new Response("", { status: 201 }); // broken off after its head
    await queue(0);
    answer = () => Response.json({ code: "idempotency.outcome_unknown" }, { status: 409 });
    await queue(0);
    answer = () => Response.json({ id: "job-1" });
    await queue(0);
    await queue(0);
    const [first, ...others] = keys();
    expect(others.map((key) => key === first)).toEqual([true, true, true, true, false]);
  });

  it("has another key after a refusal, with another body, and long after", async () => {
    answer = () => Response.json({ code: "plan.rejected" }, { status: 422 });
    await queue(1);
    answer = lost;
    await queue(1);
    await queue(2);
    await queue(1);
    vi.spyOn(performance, "now").mockReturnValue(performance.now() + 3_600_000);
    await queue(1);
    vi.restoreAllMocks();
    const [refused, one, two, oneAgain, later] = keys();
    expect(oneAgain).toBe(one);
    expect(new Set([refused, one, two, later]).size).toBe(4);
  });
});

it("says of a request without an answer what is known of it", async () => {
  answer = () => {
    throw new TypeError("network");
  };
  const calls = [
    () => api.run("r1"),
    () => api.checkJob({ plan: "p1" }, new AbortController().signal),
    () => api.runAction("r1", "pause"),
    () => api.createJob({ plan: "p1" }),
  ];
  const told = [];
  for (const ask of calls) {
    const problem = toProblem(await ask().catch((error: unknown) => error));
    told.push([problem.detail, problem.hint]);
  }
  const again = "The page reconnects by itself. Try again when it is live.";
  const unknown = "It is unknown whether this was carried out.";
  expect(told).toEqual([
    ["This could not be loaded.", again],
    ["Nothing was changed.", again],
    [unknown, "When the page is live again, look at the run before you try again."],
    [unknown, "When the page is live again, look at the jobs before you try again."],
  ]);
});

it("asks for each command by the path that the API has for it", async () => {
  for (const action of ["divert", "abort"] as const) await api.runAction("r1", action);
  await api.vehicleAction("v1", "hold");
  expect(sent.map(({ url, init }) => `${init.method} ${url}`)).toEqual([
    "POST /api/v1/runs/r1/divert",
    "POST /api/v1/runs/r1/abort",
    "POST /api/v1/vehicles/v1/hold",
  ]);
});

it("throws a refusal, an unreadable answer and no answer as a problem", async () => {
  const codeOf = (error: unknown) => (error instanceof ProblemError ? error.code : "none");
  const refusals: (() => Response)[] = [
    () => Response.json({ code: "resource.not_found", title: "Not found" }, { status: 404 }),
    () => new Response("<html>"),
    () => {
      throw new TypeError("network");
    },
  ];
  const codes: string[] = [];
  for (const refusal of refusals) {
    answer = refusal;
    codes.push(codeOf(await api.run("r1").catch((error: unknown) => error)));
  }
  expect(codes).toEqual(["resource.not_found", "answer.unreadable", "unreachable"]);
});
