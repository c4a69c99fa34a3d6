import { afterEach, beforeEach, expect, it, vi } from "vitest";
import { api } from "./client";
import { ProblemError } from "./problem";

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
