import { expect, it } from "vitest";
import { pageWords } from "./page-words";

it("a hint that names a call of the API names on the page what the page has for it", () => {
  expect(pageWords("pause it first: POST /api/v1/runs/run-1a/pause")).toBe("pause it first: “Pause” on the panel Run");
  expect(pageWords("look at the vehicle, then POST /api/v1/job-queues/v1/resume")).toBe(
    "look at the vehicle, then “Resume” on the panel Jobs",
  );
  expect(pageWords("GET /api/v1/vehicles lists them")).toBe("the fleet lists them");
  expect(pageWords("read the run, and see GET /api/v1/docs for what each state allows.")).toBe(
    "read the run, and see the documentation of the API for what each state allows.",
  );
  expect(pageWords("see GET /api/v1/something/new.")).toBe("see the API.");
  expect(pageWords("wait for its fix")).toBe("wait for its fix");
});
