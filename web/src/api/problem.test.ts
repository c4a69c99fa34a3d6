import { expect, it } from "vitest";
import { parseProblem, toProblem, unansweredRequest, unreachableProblem } from "./problem";

it("a problem document keeps its words, its code and its findings", () => {
  const problem = parseProblem(422, {
    title: "The plan is refused",
    detail: "1 error",
    code: "plan.rejected",
    hint: "fix it",
    findings: [{ code: "a.b", severity: "warning", pointer: "/items/0", message: "m", hint: "h" }],
  });
  expect(problem).toMatchObject({
    status: 422,
    title: "The plan is refused",
    detail: "1 error",
    code: "plan.rejected",
    hint: "fix it",
  });
  expect(problem.findings).toEqual([
    { code: "a.b", severity: "warning", pointer: "/items/0", message: "m", hint: "h", item_id: null, assumed: [] },
  ]);
});

it("an answer that is no problem document still becomes words", () => {
  for (const body of [null, "<html>", [1], { title: 3, findings: "x" }])
    expect(parseProblem(502, body)).toMatchObject({
      title: "The service answered 502",
      code: "http.502",
      findings: [],
      hint: expect.stringContaining("proxy"),
    });
});

it("whatever is thrown can be shown", () => {
  expect(toProblem(unreachableProblem(unansweredRequest("GET", "/api/v1/jobs"))).code).toBe("unreachable");
  expect(toProblem(new TypeError("x is not a function")).detail).toBe("x is not a function");
  expect(toProblem("why").detail).toBe("why");
});

it("a proxy that got no answer does not know what came of a command", () => {
  const unanswered = unansweredRequest("POST", "/api/v1/vehicles/{vehicle_id}/land");
  expect(parseProblem(504, "<html>", unanswered)).toMatchObject({
    detail: "It is unknown whether this was carried out.",
    hint: expect.stringMatching(/proxy.*look at the vehicle before/),
  });
  expect(parseProblem(404, "<html>", unanswered).detail).toBe("");
  expect(parseProblem(503, { code: "storage.failed", detail: "nothing was stored" }, unanswered).detail).toBe(
    "nothing was stored",
  );
});
